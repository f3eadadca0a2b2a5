// Rendered frames as SurgT has them: boxes around tissue, in both rectified views.
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <limits>

#include "sdk/scenes/writing/calibration_file.hpp"
#include "sdk/scenes/writing/layout_writer.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kBoxes = 2;
constexpr int kDifficultFrame = 2;  // of the first box

class SurgtWriter : public LayoutWriter {
  public:
    SurgtWriter(const RenderOptions& options, const Scene& scene)
        : root_(options.out_dir),
          folder_(root_ / "data" / "validation" / "case_1" / "1"),
          size_(options.width, options.height),
          views_(rectified_views(scene.rig)),
          side_(options.width / 8) {
        require_even_size(options);
        make_new_folder(folder_);
        write_stereo_calibration(scene.rig, (folder_ / "calibration.yaml").string());
        char info[256];
        std::snprintf(info, sizeof info,
                      "video_stack: vertical\nresolution: {height: %d, width: %d}\n"
                      "name_video: video.mp4\n"
                      "name_ground_truth: [gt_rectified_0.yaml, gt_rectified_1.yaml]\n",
                      size_.height, size_.width);
        write_atomically(folder_ / "info.yaml", info);
        video_.emplace(folder_ / "video.mp4", cv::Size(size_.width, 2 * size_.height));
    }

    void add(const Film& film, int frame) override {
        cv::Mat both;
        cv::vconcat(picture_of(film.left_bgr(), size_), picture_of(film.right_bgr(), size_), both);
        video_->add(both);
        if (frame == 0) choose_points(film);
        for (int box = 0; box < kBoxes; ++box) add_truth(film, frame, box);
        frames_ = frame + 1;
    }

    void finish() override {
        for (int box = 0; box < kBoxes; ++box)
            write_atomically(folder_ / ("gt_rectified_" + std::to_string(box) + ".yaml"),
                             truth_[box]);
        // As the data set's tool has it: where its trackers begin, and the window of EAO.
        char config[256];
        std::snprintf(config, sizeof config,
                      "is_to_rectify: True\n"
                      "validation:\n"
                      "    N_min: 1\n"
                      "    N_max: %d\n"
                      "    anchors: {\"case_1\": {\"1\": [[0, %d], [0]]}}\n",
                      frames_, frames_ / 2);
        write_atomically(root_ / "config.yaml", config);
        video_->finish();
    }

  private:
    // One left of the middle and one right of it.
    void choose_points(const Film& film) {
        for (int box = 0; box < kBoxes; ++box) {
            const Eigen::Vector2d wanted((1 + box) * size_.width / 3.0, size_.height / 2.0);
            double nearest = std::numeric_limits<double>::infinity();
            for (std::size_t i = 0; i < film.points().size(); ++i) {
                const double distance =
                    (Eigen::Vector2d(film.points()[i].u, film.points()[i].v) - wanted).norm();
                if (distance >= nearest) continue;
                nearest = distance;
                point_[box] = i;
            }
        }
    }

    void add_truth(const Film& film, int frame, int box) {
        const Film::Truth truth = film.truth(point_[box]);
        bool is_inside = true;
        std::string boxes;
        for (const auto& projection : {views_.left, views_.right}) {
            const Eigen::Vector3d pixel =
                projection * (views_.rotation * truth.position).homogeneous();
            const long u = std::lround(pixel.x() / pixel.z() - side_ / 2.0);
            const long v = std::lround(pixel.y() / pixel.z() - side_ / 2.0);
            is_inside = is_inside && u >= 0 && v >= 0 && u + side_ < size_.width &&
                        v + side_ < size_.height;
            char text[96];
            std::snprintf(text, sizeof text, "%s[%ld, %ld, %d, %d]", boxes.empty() ? "" : ", ", u,
                          v, side_, side_);
            boxes += text;
        }
        const bool is_seen = truth.visible && is_inside;
        const bool is_difficult = box == 0 && frame == kDifficultFrame;
        truth_[box].append(is_seen ? "- [true, " : "- [false, ");
        truth_[box].append(is_difficult ? "true, " : "false, ");
        truth_[box].append(is_seen ? "[" + boxes + "]]\n" : "null]\n");
    }

    fs::path root_, folder_;
    cv::Size size_;
    RectifiedViews views_;
    int side_;
    std::size_t point_[kBoxes] = {};
    std::string truth_[kBoxes];
    int frames_ = 0;
    std::optional<VideoFile> video_;
};

}  // namespace

std::unique_ptr<LayoutWriter> make_surgt_writer(const RenderOptions& options, const Scene& scene) {
    return std::make_unique<SurgtWriter>(options, scene);
}

}  // namespace defrec::cli
