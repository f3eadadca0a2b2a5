// Renders a scene frame by frame and writes pictures, calibration and truth.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "noise.hpp"
#include "parallel_rows.hpp"
#include "render_command.hpp"
#include "scene.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kMeshHalfWidth = 96.0;  // mm of material: more than any scene's camera sees
constexpr double kMeshHalfHeight = 78.0;
constexpr double kMeshSpacing = 0.6;
constexpr double kOcclusionSlack = 0.3;  // mm, between a point and the mesh in front of it

struct Followed {
    double u, v;               ///< px, first left image as given
    Eigen::Vector2d material;  ///< what is there
};

std::string frame_name(const char* folder, int frame) {
    char name[64];
    std::snprintf(name, sizeof name, "%s/%06d.png", folder, frame);
    return name;
}

/// Encoded in memory first: OpenCV's own writer does not report a full disk.
void write_png(const fs::path& path, const cv::Mat& image) {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1});
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) {
        throw RenderOutputError("cannot write " + path.string());
    }
}

std::ofstream open_text(const fs::path& path) {
    std::ofstream file(path);
    if (!file) {
        throw RenderOutputError("cannot write " + path.string());
    }
    return file;
}

void close_text(std::ofstream& file, const std::string& name) {
    file.close();
    if (!file) {
        throw RenderOutputError("cannot finish writing " + name);
    }
}

/// Everything that lasts from frame to frame.
class Sequence {
  public:
    Sequence(const RenderOptions& options, int frames, int threads)
        : options_(options),
          frames_(frames),
          threads_(threads),
          scene_(make_scene(options.scene, options.width, options.height, frames, options.seed)),
          tissue_(scene_.look, kMeshHalfWidth, kMeshHalfHeight, scene_.seed),
          mesh_(kMeshHalfWidth, kMeshHalfHeight, kMeshSpacing),
          left_(scene_.rig.left, options.width, options.height, threads),
          right_(scene_.rig.right, options.width, options.height, threads),
          rectification_(scene_.rig.rectification()),
          painter_(tissue_, threads) {}

    const Scene& scene() const { return scene_; }

    int render(const ProgressFn& progress, const StopFn& stop);

  private:
    void place_eyes(const CameraPose& pose);
    void choose_points(const FrameState& state);
    void paint_eye(const FrameState& state, int frame, bool is_left);
    void write_pictures(int frame) const;
    void write_truth(std::ofstream& file, int frame, const FrameState& state) const;
    bool visible(const Eigen::Vector3d& in_left, const FrameState& state) const;
    cv::Mat disparity(const FrameState& state) const;

    const RenderOptions& options_;
    int frames_, threads_;
    Scene scene_;
    Tissue tissue_;
    DeformedMesh mesh_;
    Eye left_, right_;
    Eigen::Matrix3d rectification_;
    Painter painter_;
    MeshRaster raster_;
    std::vector<Hit> left_hits_, right_hits_;
    std::vector<std::uint8_t> left_bgr_, right_bgr_;
    cv::Mat disparity_;
    std::vector<Followed> points_;
};

void Sequence::place_eyes(const CameraPose& pose) {
    left_.rotation = pose.rotation;
    left_.translation = -pose.rotation * pose.centre;
    right_.rotation = scene_.rig.rotation * left_.rotation;
    right_.translation = scene_.rig.rotation * left_.translation + scene_.rig.translation;
}

/// A grid over the first left image, less the pixels where no tissue is seen.
void Sequence::choose_points(const FrameState& state) {
    const int columns = 20;
    const int rows =
        std::max(6, static_cast<int>(std::lround(columns * 0.95 * options_.height / options_.width)));
    const double edge = 0.06 * options_.width;
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            const double u =
                std::round(100 * (edge + i * (options_.width - 1 - 2 * edge) / (columns - 1))) / 100;
            const double v =
                std::round(100 * (edge + j * (options_.height - 1 - 2 * edge) / (rows - 1))) / 100;
            const auto pixel = static_cast<std::size_t>(std::lround(v)) * options_.width +
                               static_cast<std::size_t>(std::lround(u));
            const Hit& hit = left_hits_[pixel];
            const Eigen::Vector2d ray = left_.lens.ray({u, v});
            const Eigen::Vector3d direction =
                state.camera.rotation.transpose() * Eigen::Vector3d(ray.x(), ray.y(), 1);
            Eigen::Vector2d material(hit.s, hit.t);
            if (hit.z <= 0 || !scene_.surface.intersect(state.camera.centre, direction, state.time,
                                                        state.motion, material)) {
                continue;
            }
            const Eigen::Vector3d point =
                scene_.surface.at(material.x(), material.y(), state.time, state.motion);
            if (visible(left_.from_scene(point), state)) {
                points_.push_back({u, v, material});
            }
        }
    }
}

bool Sequence::visible(const Eigen::Vector3d& in_left, const FrameState& state) const {
    if (state.outside != Outside::none || in_left.z() <= 0) {
        return false;
    }
    const Eigen::Vector2d pixel = left_.lens.project(in_left);
    const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
    if (u < 0 || v < 0 || u >= options_.width || v >= options_.height) {
        return false;
    }
    if (state.instrument) {
        const Instrument tool = left_.from_scene(*state.instrument);
        if (nearest_approach(tool, Eigen::Vector3d::Zero(), in_left, 0.0, 1.0).distance < tool.radius) {
            return false;
        }
    }
    float farthest = 0;
    for (int y = std::max(v - 1, 0); y <= std::min(v + 1, options_.height - 1); ++y) {
        for (int x = std::max(u - 1, 0); x <= std::min(u + 1, options_.width - 1); ++x) {
            farthest = std::max(farthest, left_hits_[static_cast<std::size_t>(y) * options_.width + x].z);
        }
    }
    return in_left.z() < farthest + kOcclusionSlack;
}

void Sequence::paint_eye(const FrameState& state, int frame, bool is_left) {
    const Eye& eye = is_left ? left_ : right_;
    PictureRequest request;
    const Eigen::Vector3d lamp(0.5 * scene_.rig.translation.norm(), -3.0, 0.0);
    request.lighting.lamp =
        is_left ? lamp : Eigen::Vector3d(scene_.rig.rotation * lamp + scene_.rig.translation);
    request.lighting.distance = scene_.rig.depth;
    request.lighting.exposure = scene_.exposure;
    request.sensor.seed =
        scramble(scramble(scene_.seed) ^ (2 * static_cast<std::uint64_t>(frame) + (is_left ? 0 : 1)));
    if (!is_left) {
        request.sensor.gain = {0.90f, 0.93f, 0.96f};
        request.sensor.offset = 1.5f;
        request.eye_offset = -scene_.rig.rotation.transpose() * scene_.rig.translation;
    }
    request.instrument = state.instrument;
    request.smoke = state.smoke;
    request.outside = state.outside;
    painter_.paint(eye, is_left ? left_hits_ : right_hits_, request, is_left ? left_bgr_ : right_bgr_);
}

cv::Mat Sequence::disparity(const FrameState& state) const {
    cv::Mat image(options_.height, options_.width, CV_16UC1, cv::Scalar(0));
    const double scale = scene_.rig.left.fx * -scene_.rig.translation.x();
    if (state.outside != Outside::none) {
        return image;
    }
    const bool has_tool = state.instrument.has_value();
    const Instrument tool = left_.from_scene(state.instrument.value_or(Instrument{}));
    for (int v = 0; v < options_.height; ++v) {
        for (int u = 0; u < options_.width; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * options_.width + u;
            const Hit& hit = left_hits_[pixel];
            if (hit.z <= 0) {
                continue;
            }
            const double shift = scale / hit.z;
            const double other = u - shift;
            const auto other_pixel = static_cast<std::size_t>(v) * options_.width +
                                     static_cast<std::size_t>(std::max(0L, std::lround(other)));
            if (other < 0 || std::abs(right_hits_[other_pixel].z - hit.z) > 2.0 * kOcclusionSlack) {
                continue;
            }
            if (has_tool) {
                const Eigen::Vector3d point(hit.z * left_.rays[pixel].x(), hit.z * left_.rays[pixel].y(),
                                            hit.z);
                const Eigen::Vector3d right_centre(-scene_.rig.translation.x(), 0, 0);
                const double margin = tool.radius + hit.z / scene_.rig.left.fx;
                if (nearest_approach(tool, Eigen::Vector3d::Zero(), point, 0, 1).distance < margin ||
                    nearest_approach(tool, right_centre, point - right_centre, 0, 1).distance < margin) {
                    continue;
                }
            }
            image.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(std::lround(256.0 * shift));
        }
    }
    return image;
}

void Sequence::write_pictures(int frame) const {
    const fs::path out(options_.out_dir);
    const auto picture = [&](const std::vector<std::uint8_t>& bgr) {
        return cv::Mat(options_.height, options_.width, CV_8UC3, const_cast<std::uint8_t*>(bgr.data()));
    };
    std::exception_ptr failure;
    std::thread other([&] {
        try {
            write_png(out / frame_name("right", frame), picture(right_bgr_));
        } catch (...) {
            failure = std::current_exception();
        }
    });
    try {
        write_png(out / frame_name("left", frame), picture(left_bgr_));
        if (options_.depth) {
            write_png(out / frame_name("disparity", frame), disparity_);
        }
    } catch (...) {
        other.join();
        throw;
    }
    other.join();
    if (failure) {
        std::rethrow_exception(failure);
    }
}

void Sequence::write_truth(std::ofstream& file, int frame, const FrameState& state) const {
    for (std::size_t id = 0; id < points_.size(); ++id) {
        const Eigen::Vector2d& m = points_[id].material;
        const Eigen::Vector3d in_left =
            left_.from_scene(scene_.surface.at(m.x(), m.y(), state.time, state.motion));
        const Eigen::Vector3d p = rectification_ * in_left;
        char line[160];
        std::snprintf(line, sizeof line, "%d,%zu,%.6f,%.6f,%.6f,%d\n", frame, id, p.x(), p.y(), p.z(),
                      visible(in_left, state) ? 1 : 0);
        file << line;
    }
}

int Sequence::render(const ProgressFn& progress, const StopFn& stop) {
    const fs::path out(options_.out_dir);
    const fs::path unfinished = out / "truth.csv.part";
    std::ofstream truth = open_text(unfinished);
    truth << "frame,id,x,y,z,visible\n";
    scene_.rig.write_calibration((out / "calibration.yaml").string());
    FrameState state;
    int frame = 0;
    for (; frame < frames_ && (frame == 0 || !stop || !stop()); ++frame) {
        FrameState next = scene_.at(frame);
        if (!next.repeats_previous) {
            state = next;
            place_eyes(state.camera);
            mesh_.deform(scene_.surface, state.time, state.motion, {&left_, &right_}, threads_);
            raster_.render(mesh_, left_, threads_, left_hits_);
            raster_.render(mesh_, right_, threads_, right_hits_);
            paint_eye(state, frame, true);
            paint_eye(state, frame, false);
            if (options_.depth) {
                disparity_ = disparity(state);
            }
        }
        if (frame == 0) {
            choose_points(state);
            std::ofstream file = open_text(out / "points.csv");
            file << "id,u,v\n";
            for (std::size_t id = 0; id < points_.size(); ++id) {
                char line[80];
                std::snprintf(line, sizeof line, "%zu,%.2f,%.2f\n", id, points_[id].u, points_[id].v);
                file << line;
            }
            close_text(file, "points.csv");
        }
        write_pictures(frame);
        write_truth(truth, frame, state);
        if (progress) {
            progress(frame + 1, frames_);
        }
    }
    close_text(truth, unfinished.string());
    std::error_code error;
    fs::rename(unfinished, out / "truth.csv", error);
    if (error) {
        throw RenderOutputError("cannot write " + (out / "truth.csv").string() + ": " + error.message());
    }
    return frame;
}

/// What an earlier, longer sequence left in the folder would pass for frames of this one.
void remove_leftovers(const RenderOptions& options, int frames) {
    const fs::path out(options.out_dir);
    std::error_code ignored;
    fs::remove(out / "truth.csv", ignored);
    for (const char* folder : {"left", "right", "disparity"}) {
        int frame = std::string(folder) == "disparity" && !options.depth ? 0 : frames;
        while (fs::remove(out / frame_name(folder, frame), ignored)) {
            ++frame;
        }
    }
}

void make_folders(const RenderOptions& options) {
    std::vector<std::string> folders = {"left", "right"};
    if (options.depth) {
        folders.emplace_back("disparity");
    }
    for (const std::string& folder : folders) {
        std::error_code error;
        const fs::path path = fs::path(options.out_dir) / folder;
        fs::create_directories(path, error);
        if (error) {
            throw RenderOutputError("cannot create " + path.string() + ": " + error.message());
        }
    }
}

}  // namespace

int render_sequence(const RenderOptions& options, const ProgressFn& progress, const StopFn& stop) {
    const std::string size = std::to_string(options.width) + "x" + std::to_string(options.height);
    if (options.width < 160 || options.width > 3840 || options.height < 120 || options.height > 2160) {
        throw RenderUsageError("cannot render at " + size +
                               "; sizes from 160x120 to 3840x2160 can be rendered");
    }
    if (options.frames < 0 || options.frames > 100000) {
        throw RenderUsageError("cannot render " + std::to_string(options.frames) +
                               " frames; 1 to 100000 can be");
    }
    if (options.out_dir.empty()) {
        throw RenderUsageError("no folder to write to was given; name one with --out");
    }
    const auto known = list_scenes();
    const auto info =
        std::find_if(known.begin(), known.end(), [&](const SceneInfo& s) { return s.name == options.scene; });
    const int frames = options.frames > 0 || info == known.end() ? options.frames : info->default_frames;
    const int threads = options.threads > 0
                            ? options.threads
                            : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    Sequence sequence(options, frames, threads);
    if (options.depth && !sequence.scene().info.rectified) {
        throw RenderUsageError("scene '" + options.scene +
                               "' has raw images; --depth is for rectified scenes only");
    }
    make_folders(options);
    remove_leftovers(options, frames);
    return sequence.render(progress, stop);
}

}  // namespace defrec::cli
