// Rendered frames as EDaM has the rectified Hamlyn sequences.
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include "sdk/scenes/writing/layout_writer.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

class HamlynWriter : public LayoutWriter {
  public:
    HamlynWriter(const RenderOptions& options, const Scene& scene)
        : folder_(fs::path(options.out_dir) / "rectified01"), size_(options.width, options.height) {
        require_rectified(options, scene);
        const StereoRig& rig = scene.rig;
        if (rig.left.cx != rig.right.cx) {
            throw RenderUsageError("the views of scene '" + options.scene +
                                   "' differ in their cameras; --layout hamlyn has one for both");
        }
        for (const char* folder : {"color", "image02", "depth"}) make_new_folder(folder_ / folder);
        char text[256];
        std::snprintf(text, sizeof text, "%.17g 0 %.17g\n0 %.17g %.17g\n0 0 1\n", rig.left.fx,
                      rig.left.cx, rig.left.fy, rig.left.cy);
        write_atomically(folder_ / "intrinsics.txt", text);
        std::snprintf(text, sizeof text, "1 0 0 %.17g\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
                      rig.translation.x());
        write_atomically(folder_ / "extrinsics.txt", text);
    }

    void add(const Film& film, int frame) override {
        char stem[16];
        std::snprintf(stem, sizeof stem, "%010d", frame);
        const std::string name(stem);
        const std::vector<int> best{cv::IMWRITE_JPEG_QUALITY, 100};
        write_image(folder_ / "color" / (name + ".jpg"), picture_of(film.left_bgr(), size_), best);
        write_image(folder_ / "image02" / (name + ".jpg"), picture_of(film.right_bgr(), size_),
                    best);
        const std::vector<float> xyz = film.left_surface();
        cv::Mat depth(size_, CV_16UC1, cv::Scalar(0));
        for (int i = 0; i < size_.area(); ++i) {
            const float z = xyz[3 * static_cast<std::size_t>(i) + 2];
            if (std::isfinite(z))
                depth.at<std::uint16_t>(i / size_.width, i % size_.width) =
                    cv::saturate_cast<std::uint16_t>(z);
        }
        write_image(folder_ / "depth" / (name + ".png"), depth, {cv::IMWRITE_PNG_COMPRESSION, 1});
    }

    void finish() override {}

  private:
    fs::path folder_;
    cv::Size size_;
};

}  // namespace

std::unique_ptr<LayoutWriter> make_hamlyn_writer(const RenderOptions& options, const Scene& scene) {
    return std::make_unique<HamlynWriter>(options, scene);
}

}  // namespace defrec::cli
