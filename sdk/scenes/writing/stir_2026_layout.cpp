// Rendered frames as STIR 2026 has them.
#include <cstdio>

#include "sdk/scenes/writing/layout_writer.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kEvery = 7;  // so many points of the film are annotated
constexpr int kEveryFrame = 2;

class Stir2026Writer : public LayoutWriter {
  public:
    Stir2026Writer(const RenderOptions& options, const Scene& scene)
        : folder_(fs::path(options.out_dir) / "seq00"), rig_(scene.rig) {
        require_even_size(options);
        require_rectified(options, scene);
        make_new_folder(folder_);
        write_atomically(folder_ / "calib.json", calibration());
        const cv::Size size(options.width, options.height);
        left_video_.emplace(folder_ / "left.mp4", size);
        right_video_.emplace(folder_ / "right.mp4", size);
    }

    void add(const Film& film, int frame) override {
        const cv::Size size(rig_.width, rig_.height);
        left_video_->add(picture_of(film.left_bgr(), size));
        right_video_->add(picture_of(film.right_bgr(), size));
        if (frame % kEveryFrame == 0) annotate(film, frame);
    }

    void finish() override {
        write_atomically(folder_ / "annotations.json", "{" + annotations_ + "}\n");
        left_video_->finish();
        right_video_->finish();
    }

  private:
    void annotate(const Film& film, int frame) {
        std::string x, y, disparity, left_visible, right_visible;
        for (std::size_t point = 0; point < film.points().size(); point += kEvery) {
            const Film::Truth truth = film.truth(point);
            const Eigen::Vector2d left = rig_.left.project(truth.position);
            const Eigen::Vector2d right =
                rig_.right.project(rig_.rotation * truth.position + rig_.translation);
            const bool in_right = right.x() >= 0 && right.x() <= rig_.width - 1;
            append(x, left.x());
            append(y, left.y());
            append(disparity, left.x() - right.x());
            const char* comma = left_visible.empty() ? "" : ", ";
            left_visible.append(comma).append(truth.visible ? "true" : "false");
            right_visible.append(comma).append(truth.visible && in_right ? "true" : "false");
        }
        annotations_.append(annotations_.empty() ? "\"" : ",\n\"").append(std::to_string(frame));
        annotations_.append("/0\": {\"left_x\": [").append(x);
        annotations_.append("], \"left_y\": [").append(y);
        annotations_.append("], \"disparity\": [").append(disparity);
        annotations_.append("], \"left_visibility\": [").append(left_visible);
        annotations_.append("], \"right_visibility\": [").append(right_visible).append("]}");
    }

    static void append(std::string& list, double value) {
        char text[40];
        std::snprintf(text, sizeof text, "%s%.6f", list.empty() ? "" : ", ", value);
        list += text;
    }

    std::string calibration() const {
        constexpr double kMillimetresPerMetre = 1000;
        const Lens &left = rig_.left, &right = rig_.right;
        char text[1024];
        std::snprintf(text, sizeof text,
                      "{\"K_left\": [[%.17g, 0, %.17g], [0, %.17g, %.17g], [0, 0, 1]],\n"
                      " \"K_right\": [[%.17g, 0, %.17g], [0, %.17g, %.17g], [0, 0, 1]],\n"
                      " \"D_left\": [0, 0, 0, 0, 0], \"D_right\": [0, 0, 0, 0, 0],\n"
                      " \"R_left_to_right\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],\n"
                      " \"t_left_to_right\": [%.17g, 0, 0]}\n",
                      left.fx, left.cx, left.fy, left.cy, right.fx, right.cx, right.fy, right.cy,
                      rig_.translation.x() / kMillimetresPerMetre);
        return text;
    }

    fs::path folder_;
    StereoRig rig_;
    std::optional<VideoFile> left_video_, right_video_;
    std::string annotations_;
};

}  // namespace

std::unique_ptr<LayoutWriter> make_stir_2026_writer(const RenderOptions& options,
                                                    const Scene& scene) {
    return std::make_unique<Stir2026Writer>(options, scene);
}

}  // namespace defrec::cli
