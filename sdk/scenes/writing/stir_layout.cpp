// Rendered frames as STIR 2024 and 2025 have them: some of the tissue is marked, as by ICG, in the
// first and in the last image of both views.
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "sdk/scenes/writing/layout_writer.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kMarkRadius = 4;      // px
constexpr std::size_t kEvery = 11;  // so many points of the film give a mark
constexpr double kMillimetresPerMetre = 1000;

struct Marks {
    cv::Mat left, right;
};

class StirWriter : public LayoutWriter {
  public:
    StirWriter(const RenderOptions& options, const Scene& scene)
        : root_(fs::path(options.out_dir) / "1"),
          size_(options.width, options.height),
          rig_(scene.rig) {
        require_even_size(options);
        require_rectified(options, scene);
        for (const fs::path& folder : {left_, right_}) {
            make_new_folder(root_ / folder);
            make_folder(root_ / folder / "frames");
            make_folder(root_ / folder / "segmentation");
        }
        write_atomically(root_ / "calib.json", calibration());
        const int frames = options.frames > 0 ? options.frames : scene.info.default_frames;
        char video[64];
        std::snprintf(video, sizeof video, "frames/00000000ms-%08dms-visible.mp4",
                      VideoFile::kFrameMs * frames);
        left_video_.emplace(root_ / left_ / video, size_);
        right_video_.emplace(root_ / right_ / video, size_);
    }

    void add(const Film& film, int frame) override {
        const cv::Mat left = picture_of(film.left_bgr(), size_);
        const cv::Mat right = picture_of(film.right_bgr(), size_);
        left_video_->add(left);
        right_video_->add(right);
        last_left_ = left.clone();
        last_right_ = right.clone();
        last_marks_ = marks_of(film);
        if (frame == 0) write_marks("start", left, right, last_marks_);
    }

    void finish() override {
        write_marks("end", last_left_, last_right_, last_marks_);
        left_video_->finish();
        right_video_->finish();
    }

  private:
    Marks marks_of(const Film& film) const {
        Marks marks{cv::Mat::zeros(size_, CV_8U), cv::Mat::zeros(size_, CV_8U)};
        for (std::size_t point = 0; point < film.points().size(); point += kEvery) {
            const Film::Truth truth = film.truth(point);
            if (!truth.visible) continue;
            const Eigen::Vector2d left = rig_.left.project(truth.position);
            const cv::Point2d right = place_in_right(rig_, truth.position);
            if (std::isnan(right.x)) continue;
            mark(marks.left, {left.x(), left.y()});
            mark(marks.right, right);
        }
        return marks;
    }

    static void mark(cv::Mat& image, cv::Point2d place) {
        const cv::Point centre(static_cast<int>(std::lround(place.x)),
                               static_cast<int>(std::lround(place.y)));
        cv::circle(image, centre, kMarkRadius, cv::Scalar(255), cv::FILLED);
    }

    void write_marks(const std::string& when, const cv::Mat& left, const cv::Mat& right,
                     const Marks& marks) const {
        for (const auto& [folder, image, segmentation] :
             {std::tuple(left_, left, marks.left), std::tuple(right_, right, marks.right)}) {
            write_image(root_ / folder / ("000000_icg" + when + ".png"), image);
            write_image(root_ / folder / "segmentation" / ("icg" + when + "seg.png"), segmentation);
        }
    }

    std::string calibration() const {
        const Lens &left = rig_.left, &right = rig_.right;
        char text[1024];
        std::snprintf(text, sizeof text,
                      "{\"leftcameramat\": [[%.17g, 0, %.17g], [0, %.17g, %.17g], [0, 0, 1]],\n"
                      " \"rightcameramat\": [[%.17g, 0, %.17g], [0, %.17g, %.17g], [0, 0, 1]],\n"
                      " \"leftdistortioncoeffs\": [0, 0, 0, 0, 0],\n"
                      " \"rightdistortioncoeffs\": [0, 0, 0, 0, 0],\n"
                      " \"rotation\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],\n"
                      " \"translation\": [%.17g, 0, 0]}\n",
                      left.fx, left.cx, left.fy, left.cy, right.fx, right.cx, right.fy, right.cy,
                      rig_.translation.x() / kMillimetresPerMetre);
        return text;
    }

    fs::path root_;
    fs::path left_ = fs::path("left") / "seq00", right_ = fs::path("right") / "seq00";
    cv::Size size_;
    StereoRig rig_;
    std::optional<VideoFile> left_video_, right_video_;
    cv::Mat last_left_, last_right_;
    Marks last_marks_;
};

}  // namespace

std::unique_ptr<LayoutWriter> make_stir_writer(const RenderOptions& options, const Scene& scene) {
    return std::make_unique<StirWriter>(options, scene);
}

}  // namespace defrec::cli
