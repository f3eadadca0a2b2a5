// Rendered frames in the layouts of public data sets.
#include "sdk/cli/render/layouts.hpp"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "sdk/base/atomic_file.hpp"
#include "sdk/cli/render/calibration_file.hpp"
#include "sdk/cli/render/film.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

void make_folder(const fs::path& path) {
    std::error_code error;
    fs::create_directories(path, error);
    if (error) throw RenderOutputError("cannot create " + path.string() + ": " + error.message());
}

/// Encoded in memory first: OpenCV's own writer does not report a full disk.
void write_image(const fs::path& path, const cv::Mat& image, const std::vector<int>& parameters) {
    std::vector<unsigned char> bytes;
    cv::imencode(path.extension().string(), image, bytes, parameters);
    write_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

cv::Mat picture_of(const std::vector<std::uint8_t>& bgr, cv::Size size) {
    return {size.height, size.width, CV_8UC3, const_cast<std::uint8_t*>(bgr.data())};
}

/// Takes the frames of a film one after the other.
class LayoutWriter {
  public:
    virtual ~LayoutWriter() = default;
    virtual void add(const Film& film, int frame) = 0;
    virtual void finish() = 0;
};

/// A keyframe with its sequence: what `defrec evaluate --dataset scared` reads.
class ScaredWriter : public LayoutWriter {
  public:
    ScaredWriter(const RenderOptions& options, const Scene& scene)
        : folder_(fs::path(options.out_dir) / "dataset_1" / "keyframe_1"),
          size_(options.width, options.height) {
        if (size_.width % 2 != 0 || size_.height % 2 != 0)
            throw RenderUsageError("--layout scared writes a video; give an even size");
        // What an earlier sequence left there would pass for frames of this one.
        std::error_code ignored;
        fs::remove_all(folder_ / "data" / "scene_points", ignored);
        make_folder(folder_ / "data" / "scene_points");
        write_stereo_calibration(scene.rig, (folder_ / "endoscope_calibration.yaml").string());
        video_file_ = std::make_unique<AtomicFile>(folder_ / "data" / "rgb.mp4");
        constexpr double kFps = 25;
        if (!video_.open(video_file_->temporary().string(), cv::CAP_FFMPEG,
                         cv::VideoWriter::fourcc('m', 'p', '4', 'v'), kFps,
                         cv::Size(size_.width, 2 * size_.height)))
            throw RenderOutputError("cannot encode a video: this OpenCV has no encoder for it");
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
        video_.write(both);
        // The right view's half has no truth; of a sequence 0 is unknown.
        cv::Mat stacked(2 * size_.height, size_.width, CV_32FC3, cv::Scalar::all(0));
        points.copyTo(stacked.rowRange(0, size_.height));
        cv::patchNaNs(stacked, 0);
        char name[48];
        std::snprintf(name, sizeof name, "data/scene_points/scene_points%06d.tiff", frame);
        write_points(name, stacked);
    }

    void finish() override {
        video_.release();
        video_file_->commit();
    }

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
    std::unique_ptr<AtomicFile> video_file_;
    cv::VideoWriter video_;
};

/// Rectified images with disparity and depth: what `defrec evaluate --dataset serv-ct` reads.
class ServCtWriter : public LayoutWriter {
  public:
    ServCtWriter(const RenderOptions& options, const Scene& scene)
        : folder_(fs::path(options.out_dir) / "Experiment_1"),
          size_(options.width, options.height),
          rig_(scene.rig) {
        if (!scene.info.rectified) {
            throw RenderUsageError("scene '" + options.scene +
                                   "' has raw images; --layout serv-ct is for rectified scenes");
        }
        for (const char* folder : {"Left_rectified", "Right_rectified", "Rectified_calibration",
                                   "Ground_truth_CT/DepthL", "Ground_truth_CT/Disparity",
                                   "Ground_truth_CT/OcclusionL"}) {
            // What an earlier sequence left there would pass for frames of this one.
            std::error_code ignored;
            fs::remove_all(folder_ / folder, ignored);
            make_folder(folder_ / folder);
        }
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

std::unique_ptr<LayoutWriter> make_writer(const RenderOptions& options, const Scene& scene) {
    if (options.layout == "scared") return std::make_unique<ScaredWriter>(options, scene);
    return std::make_unique<ServCtWriter>(options, scene);
}

}  // namespace

std::vector<std::string> public_layouts() { return {"scared", "serv-ct"}; }

int render_layout(const RenderOptions& options, int frames, int threads, const ProgressFn& progress,
                  const StopFn& stop) {
    Film film(options.scene, options.width, options.height, frames, options.seed, threads,
              options.settings);
    if (film.scene().compression.jpeg_quality > 0 || film.scene().compression.h264_contrast > 0) {
        throw RenderUsageError("scene '" + options.scene +
                               "' is compressed in its own way; --layout takes the others");
    }
    try {
        const std::unique_ptr<LayoutWriter> writer = make_writer(options, film.scene());
        int frame = 0;
        for (; frame < frames && (frame == 0 || !stop || !stop()); ++frame) {
            film.advance();
            writer->add(film, frame);
            if (progress) progress(frame + 1, frames);
        }
        writer->finish();
        return frame;
    } catch (const FileError& error) {
        throw RenderOutputError(error.what());
    }
}

}  // namespace defrec::cli
