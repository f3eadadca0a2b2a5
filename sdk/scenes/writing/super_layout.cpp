// Rendered frames as SuPer has them: images, and labelled points in some of them.
#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include "sdk/scenes/writing/calibration_file.hpp"
#include "sdk/scenes/writing/layout_writer.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLabels = 20;
constexpr int kEvery = 2;  // frames from label to label

class SuPerWriter : public LayoutWriter {
  public:
    SuPerWriter(const RenderOptions& options, const Scene& scene)
        : folder_(fs::path(options.out_dir) / "super"), rig_(scene.rig) {
        require_rectified(options, scene);
        make_new_folder(folder_ / "rgb");
        write_calibration(rig_, (folder_ / "calibration.yaml").string());
    }

    void add(const Film& film, int frame) override {
        char stem[16];
        std::snprintf(stem, sizeof stem, "%06d", frame);
        const cv::Size size(rig_.width, rig_.height);
        const auto write = [&](const char* view, const std::vector<std::uint8_t>& bgr) {
            write_image(folder_ / "rgb" / (std::string(stem) + view + ".png"),
                        picture_of(bgr, size), {cv::IMWRITE_PNG_COMPRESSION, 1});
        };
        write("-left", film.left_bgr());
        write("-right", film.right_bgr());
        if (frame % kEvery != 0) return;
        std::string rows;
        for (std::size_t label = 0; label < kLabels; ++label) {
            const Film::Truth truth = film.truth(label * film.points().size() / kLabels);
            const Eigen::Vector2d pixel = rig_.left.project(truth.position);
            char row[96];
            std::snprintf(row, sizeof row, "%s[%.4f, %.4f, %d]", label > 0 ? ", " : "", pixel.x(),
                          pixel.y(), truth.visible ? 1 : 0);
            rows += row;
        }
        labels_.append(labels_.empty() ? "\"" : ",\n\"").append(stem);
        labels_.append("\": [").append(rows).append("]");
    }

    /// What scripts/convert_super_truth.py makes of the data set's file.
    void finish() override {
        write_atomically(folder_ / "rgb" / "left_pts.json", "{\"gt\": {" + labels_ + "}}\n");
    }

  private:
    fs::path folder_;
    StereoRig rig_;
    std::string labels_;
};

}  // namespace

std::unique_ptr<LayoutWriter> make_super_writer(const RenderOptions& options, const Scene& scene) {
    return std::make_unique<SuPerWriter>(options, scene);
}

}  // namespace defrec::cli
