// Rendered frames as SCARED has them.
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include "sdk/scenes/writing/calibration_file.hpp"
#include "sdk/scenes/writing/layout_writer.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

/// A keyframe with its sequence: what `defrec evaluate --dataset scared` reads.
class ScaredWriter : public LayoutWriter {
  public:
    ScaredWriter(const RenderOptions& options, const Scene& scene)
        : folder_(fs::path(options.out_dir) / "dataset_1" / "keyframe_1"),
          size_(options.width, options.height) {
        require_even_size(options);
        make_new_folder(folder_ / "data" / "scene_points");
        write_stereo_calibration(scene.rig, (folder_ / "endoscope_calibration.yaml").string());
        video_.emplace(folder_ / "data" / "rgb.mp4", cv::Size(size_.width, 2 * size_.height));
    }

    void add(const Film& film, int frame) override {
        const cv::Mat left = picture_of(film.left_bgr(), size_);
        const cv::Mat right = picture_of(film.right_bgr(), size_);
        const cv::Mat points = points_of(film);
        if (frame == 0) {
            write_image(folder_ / "Left_Image.png", left, {cv::IMWRITE_PNG_COMPRESSION, 1});
            write_image(folder_ / "Right_Image.png", right, {cv::IMWRITE_PNG_COMPRESSION, 1});
            write_points("left_depth_map.tiff", points);
        }
        cv::Mat both;
        cv::vconcat(left, right, both);
        video_->add(both);
        // The right view's half has no truth; of a sequence 0 is unknown.
        cv::Mat stacked(2 * size_.height, size_.width, CV_32FC3, cv::Scalar::all(0));
        points.copyTo(stacked.rowRange(0, size_.height));
        cv::patchNaNs(stacked, 0);
        char name[48];
        std::snprintf(name, sizeof name, "data/scene_points/scene_points%06d.tiff", frame);
        write_points(name, stacked);
    }

    void finish() override { video_->finish(); }

  private:
    /// z, y, x: OpenCV writes a colour image's channels in reverse.
    cv::Mat points_of(const Film& film) const {
        std::vector<float> xyz = film.left_surface();
        cv::Mat points(size_, CV_32FC3);
        for (int v = 0; v < size_.height; ++v)
            for (int u = 0; u < size_.width; ++u) {
                const float* p = xyz.data() + 3 * (static_cast<std::size_t>(v) * size_.width + u);
                points.at<cv::Vec3f>(v, u) = {p[2], p[1], p[0]};
            }
        return points;
    }

    void write_points(const char* name, const cv::Mat& points) const {
        constexpr int kNoCompression = 1;
        write_image(folder_ / name, points, {cv::IMWRITE_TIFF_COMPRESSION, kNoCompression});
    }

    fs::path folder_;
    cv::Size size_;
    std::optional<VideoFile> video_;
};

}  // namespace

std::unique_ptr<LayoutWriter> make_scared_writer(const RenderOptions& options, const Scene& scene) {
    return std::make_unique<ScaredWriter>(options, scene);
}

}  // namespace defrec::cli
