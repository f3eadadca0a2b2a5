// Rendered frames as StereoMIS has them: a video and the camera's poses.
#include <Eigen/Geometry>
#include <cstdio>

#include "sdk/scenes/writing/layout_writer.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

class StereoMisWriter : public LayoutWriter {
  public:
    StereoMisWriter(const RenderOptions& options, const Scene& scene)
        : folder_(fs::path(options.out_dir) / "P1"), size_(options.width, options.height) {
        require_even_size(options);
        make_new_folder(folder_);
        write_atomically(folder_ / "StereoCalibration.ini", calibration(scene.rig));
        video_.emplace(folder_ / "P1.mp4", cv::Size(size_.width, 2 * size_.height));
    }

    void add(const Film& film, int frame) override {
        constexpr double kMillimetresPerMetre = 1000;
        cv::Mat both;
        cv::vconcat(picture_of(film.left_bgr(), size_), picture_of(film.right_bgr(), size_), both);
        video_->add(both);
        const FrameState state = film.scene().at(frame);
        // A frame that shows the one before has its truth too.
        const CameraPose camera = state.repeats_previous ? camera_ : state.camera;
        camera_ = camera;
        const Eigen::Vector3d centre = camera.centre / kMillimetresPerMetre;
        const Eigen::Quaterniond turn(camera.rotation.transpose());
        char line[256];
        std::snprintf(line, sizeof line, "%d %.12g %.12g %.12g %.12g %.12g %.12g %.12g\n", frame,
                      centre.x(), centre.y(), centre.z(), turn.x(), turn.y(), turn.z(), turn.w());
        poses_ += line;
    }

    void finish() override {
        write_atomically(folder_ / "groundtruth.txt", poses_);
        video_->finish();
    }

  private:
    static void append(std::string& text, const std::string& key, double value) {
        char line[80];
        std::snprintf(line, sizeof line, "%s=%.17g\n", key.c_str(), value);
        text += line;
    }
    static void append_lens(std::string& text, const StereoRig& rig, const Lens& lens) {
        constexpr int kCoefficients = 8;
        append(text, "res_x", rig.width);
        append(text, "res_y", rig.height);
        append(text, "fc_x", lens.fx);
        append(text, "fc_y", lens.fy);
        append(text, "cc_x", lens.cx);
        append(text, "cc_y", lens.cy);
        for (std::size_t i = 0; i < kCoefficients; ++i) {
            append(text, "kc_" + std::to_string(i),
                   i < lens.distortion.size() ? lens.distortion[i] : 0);
        }
    }
    static std::string calibration(const StereoRig& rig) {
        std::string text = "[StereoLeft]\n";
        append_lens(text, rig, rig.left);
        text += "[StereoRight]\n";
        append_lens(text, rig, rig.right);
        for (int i = 0; i < 9; ++i)
            append(text, "R_" + std::to_string(i), rig.rotation(i / 3, i % 3));
        for (int i = 0; i < 3; ++i) append(text, "T_" + std::to_string(i), rig.translation(i));
        return text;
    }

    fs::path folder_;
    cv::Size size_;
    CameraPose camera_;  // of the frame before
    std::string poses_;
    std::optional<VideoFile> video_;
};

}  // namespace

std::unique_ptr<LayoutWriter> make_stereomis_writer(const RenderOptions& options,
                                                    const Scene& scene) {
    return std::make_unique<StereoMisWriter>(options, scene);
}

}  // namespace defrec::cli
