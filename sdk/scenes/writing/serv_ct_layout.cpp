// Rendered frames as SERV-CT has them.
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include "sdk/scenes/writing/layout_writer.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

/// Rectified images with disparity and depth: what `defrec evaluate --dataset serv-ct` reads.
class ServCtWriter : public LayoutWriter {
  public:
    ServCtWriter(const RenderOptions& options, const Scene& scene)
        : folder_(fs::path(options.out_dir) / "Experiment_1"),
          size_(options.width, options.height),
          rig_(scene.rig) {
        require_rectified(options, scene);
        for (const char* folder :
             {"Left_rectified", "Right_rectified", "Rectified_calibration",
              "Ground_truth_CT/DepthL", "Ground_truth_CT/Disparity", "Ground_truth_CT/OcclusionL"})
            make_new_folder(folder_ / folder);
    }

    void add(const Film& film, int frame) override {
        char stem[16];
        std::snprintf(stem, sizeof stem, "%03d", frame + 1);
        const std::string png = std::string(stem) + ".png";
        const auto write = [&](const char* folder, const cv::Mat& image) {
            write_image(folder_ / folder / png, image, {cv::IMWRITE_PNG_COMPRESSION, 1});
        };
        write("Left_rectified", picture_of(film.left_bgr(), size_));
        write("Right_rectified", picture_of(film.right_bgr(), size_));
        write_atomically(folder_ / "Rectified_calibration" / (std::string(stem) + ".json"),
                         calibration());
        const std::vector<float> xyz = film.left_surface();
        const std::vector<std::uint16_t> in_both = film.disparity();
        cv::Mat depth(size_, CV_16UC1, cv::Scalar(0)), disparity = depth.clone();
        cv::Mat occlusion(size_, CV_8UC3, cv::Scalar::all(0));
        constexpr double kScale = 256;
        const double scale = rig_.left.fx * -rig_.translation.x();
        for (int v = 0; v < size_.height; ++v) {
            for (int u = 0; u < size_.width; ++u) {
                const std::size_t pixel = static_cast<std::size_t>(v) * size_.width + u;
                const double z = xyz[3 * pixel + 2];
                if (std::isnan(z)) {
                    occlusion.at<cv::Vec3b>(v, u) = {255, 0, 0};  // blue: no truth
                    continue;
                }
                depth.at<std::uint16_t>(v, u) = cv::saturate_cast<std::uint16_t>(kScale * z);
                disparity.at<std::uint16_t>(v, u) = cv::saturate_cast<std::uint16_t>(
                    kScale * (scale / z + rig_.left.cx - rig_.right.cx));
                if (in_both[pixel] == 0)
                    occlusion.at<cv::Vec3b>(v, u) = {0, 255, 255};  // yellow: in this view only
            }
        }
        write("Ground_truth_CT/DepthL", depth);
        write("Ground_truth_CT/Disparity", disparity);
        write("Ground_truth_CT/OcclusionL", occlusion);
    }

    void finish() override {}

  private:
    std::string calibration() const {
        const Lens &left = rig_.left, &right = rig_.right;
        const double tx = rig_.translation.x();
        char text[1024];
        std::snprintf(text, sizeof text,
                      "{\"P1\": [[%.17g, 0, %.17g, 0], [0, %.17g, %.17g, 0], [0, 0, 1, 0]],\n"
                      " \"P2\": [[%.17g, 0, %.17g, %.17g], [0, %.17g, %.17g, 0], [0, 0, 1, 0]],\n"
                      " \"Q\": [[1, 0, 0, %.17g], [0, 1, 0, %.17g], [0, 0, 0, %.17g], "
                      "[0, 0, %.17g, %.17g]]}\n",
                      left.fx, left.cx, left.fy, left.cy, right.fx, right.cx, right.fx * tx,
                      right.fy, right.cy, -left.cx, -left.cy, left.fx, -1 / tx,
                      (left.cx - right.cx) / tx);
        return text;
    }

    fs::path folder_;
    cv::Size size_;
    StereoRig rig_;
};

}  // namespace

std::unique_ptr<LayoutWriter> make_serv_ct_writer(const RenderOptions& options,
                                                  const Scene& scene) {
    return std::make_unique<ServCtWriter>(options, scene);
}

}  // namespace defrec::cli
