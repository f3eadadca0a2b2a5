// Renders a scene frame by frame and writes pictures, calibration and truth.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <thread>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/io/text.hpp"
#include "sdk/scenes/film.hpp"
#include "sdk/scenes/writing/body_files.hpp"
#include "sdk/scenes/writing/calibration_file.hpp"
#include "sdk/scenes/writing/h264_pass.hpp"
#include "sdk/scenes/writing/layouts.hpp"
#include "sdk/scenes/writing/render_command.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

std::string frame_name(const char* folder, int frame) {
    char name[64];
    std::snprintf(name, sizeof name, "%s/%06d.png", folder, frame);
    return name;
}

/// Encoded in memory first: OpenCV's own writer does not report a full disk.
void write_png(const fs::path& path, const cv::Mat& image) {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1});
    write_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// What is left of an image after JPEG.
cv::Mat after_jpeg(const cv::Mat& image, int quality) {
    std::vector<unsigned char> bytes;
    cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
    return cv::imdecode(bytes, cv::IMREAD_COLOR);
}

/// Everything that lasts from frame to frame.
class Sequence {
  public:
    Sequence(const RenderOptions& options, int frames, int threads)
        : options_(options),
          frames_(frames),
          film_(options.scene, options.width, options.height, frames, options.seed, threads,
                options.settings),
          rectification_(rectification(film_.scene().rig)) {}

    const Scene& scene() const { return film_.scene(); }

    int render(const ProgressFn& progress, const StopFn& stop);

  private:
    void film_next(AtomicFile& truth, BodyFiles* body_files);
    void keep_field(bool is_bottom);
    void write_points() const;
    void write_pictures(int number);
    void write_decoded(int frames);
    void write_truth(AtomicFile& file, int frame) const;

    const RenderOptions& options_;
    int frames_;
    Film film_;
    Eigen::Matrix3d rectification_;
    std::optional<H264Pass> left_video_, right_video_;
    int filmed_ = 0;                          ///< frames of the film
    std::vector<std::uint8_t> left_, right_;  ///< an interlaced image's fields
};

/// Films a frame, or a field, with its truth.
void Sequence::film_next(AtomicFile& truth, BodyFiles* body_files) {
    const int frame = filmed_++;
    film_.advance(1.0 / frames_of_image(options_.fields));
    const bool gives_points =
        frame > 0 && std::find(options_.points_at.begin(), options_.points_at.end(), frame) !=
                         options_.points_at.end();
    if (gives_points) {
        film_.add_points();
    }
    if (frame == 0 || gives_points) {
        write_points();
    }
    write_truth(truth, frame);
    if (body_files != nullptr) {
        body_files->write(frame);
    }
    if (is_interlaced(options_.fields)) {
        keep_field(is_bottom_field(options_.fields, frame));
    }
}

void Sequence::keep_field(bool is_bottom) {
    const auto row = static_cast<std::ptrdiff_t>(3) * options_.width;
    const auto keep = [&](const std::vector<std::uint8_t>& from, std::vector<std::uint8_t>& to) {
        to.resize(from.size());
        for (int y = is_bottom ? 1 : 0; y < options_.height; y += kFieldsOfImage) {
            std::copy_n(from.begin() + y * row, row, to.begin() + y * row);
        }
    };
    keep(film_.left_bgr(), left_);
    keep(film_.right_bgr(), right_);
}

void Sequence::write_points() const {
    const bool has_frames = !options_.points_at.empty();
    std::string text = has_frames ? "id,u,v,frame\n" : "id,u,v\n";
    for (std::size_t id = 0; id < film_.points().size(); ++id) {
        char line[80];
        const Film::Followed& point = film_.points()[id];
        std::snprintf(line, sizeof line, "%zu,%.2f,%.2f", id, point.u, point.v);
        text += line;
        if (has_frames) text.append(",").append(std::to_string(point.frame));
        text += "\n";
    }
    write_atomically(fs::path(options_.out_dir) / "points.csv", text);
}

void Sequence::write_pictures(int number) {
    const fs::path out(options_.out_dir);
    const auto picture = [&](const std::vector<std::uint8_t>& bgr) {
        const cv::Mat image(options_.height, options_.width, CV_8UC3,
                            const_cast<std::uint8_t*>(bgr.data()));
        const int quality = film_.scene().compression.jpeg_quality;
        return quality > 0 ? after_jpeg(image, quality) : image;
    };
    const auto keep = [&](std::optional<H264Pass>& video, const char* folder,
                          const std::vector<std::uint8_t>& bgr) {
        if (video) {
            video->write(picture(bgr));
        } else {
            write_png(out / frame_name(folder, number), picture(bgr));
        }
    };
    std::exception_ptr failure;
    std::thread other([&] {
        try {
            keep(right_video_, "right",
                 is_interlaced(options_.fields) ? right_ : film_.right_bgr());
        } catch (...) {
            failure = std::current_exception();
        }
    });
    try {
        keep(left_video_, "left", is_interlaced(options_.fields) ? left_ : film_.left_bgr());
        if (options_.depth) {
            std::vector<std::uint16_t> disparity = film_.disparity();
            write_png(out / frame_name("disparity", number),
                      cv::Mat(options_.height, options_.width, CV_16UC1, disparity.data()));
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

/// The pictures that went through a video, once the last of them is in it.
void Sequence::write_decoded(int frames) {
    const fs::path out(options_.out_dir);
    left_video_->end_writing();
    right_video_->end_writing();
    for (int frame = 0; frame < frames; ++frame) {
        write_png(out / frame_name("left", frame), left_video_->read());
        write_png(out / frame_name("right", frame), right_video_->read());
    }
}

void Sequence::write_truth(AtomicFile& file, int frame) const {
    for (std::size_t id = 0; id < film_.points().size(); ++id) {
        const Film::Truth truth = film_.truth(id);
        const Eigen::Vector3d p = rectification_ * truth.position;
        char line[160];
        std::snprintf(line, sizeof line, "%d,%zu,%.6f,%.6f,%.6f,%d\n", frame, id, p.x(), p.y(),
                      p.z(), truth.visible ? 1 : 0);
        file.write(line);
    }
}

int Sequence::render(const ProgressFn& progress, const StopFn& stop) {
    const fs::path out(options_.out_dir);
    AtomicFile truth(out / "truth.csv");
    truth.write("frame,id,x,y,z,visible\n");
    std::optional<BodyFiles> body_files;
    if (film_.scene().body) {
        body_files.emplace(out, film_, rectification_);
    }
    write_calibration(film_.scene().rig, (out / "calibration.yaml").string());
    const double contrast = film_.scene().compression.h264_contrast;
    if (contrast > 0) {
        const cv::Size size(options_.width, options_.height);
        left_video_.emplace(out / "left.mp4", size, contrast);
        right_video_.emplace(out / "right.mp4", size, contrast);
    }
    int frame = 0;
    for (; frame < frames_ && (frame == 0 || !stop || !stop()); ++frame) {
        for (int part = 0; part < frames_of_image(options_.fields); ++part) {
            film_next(truth, body_files ? &*body_files : nullptr);
        }
        write_pictures(frame);
        if (progress) {
            progress(frame + 1, frames_);
        }
    }
    if (left_video_) {
        write_decoded(frame);
    }
    if (body_files) {
        body_files->commit();
    }
    truth.commit();
    return frame;
}

/// What an earlier, longer sequence left in the folder would pass for frames of this one.
void remove_leftovers(const RenderOptions& options, int frames) {
    const fs::path out(options.out_dir);
    std::error_code ignored;
    fs::remove(out / "truth.csv", ignored);
    for (const std::string& file : BodyFiles::names()) {
        fs::remove(out / file, ignored);
    }
    for (const char* folder : {"left", "right", "disparity"}) {
        int frame = std::string(folder) == "disparity" && !options.depth ? 0 : frames;
        while (fs::remove(out / frame_name(folder, frame), ignored)) {
            ++frame;
        }
    }
}

bool is_frame_name(const std::string& name) {
    int frame = 0, used = 0;
    return std::sscanf(name.c_str(), "%6d.png%n", &frame, &used) == 1 && used == 10 &&
           name.size() == 10 && frame >= 0;
}

[[noreturn]] void refuse_file_of_others(const fs::path& file, const std::string& why) {
    throw RenderUsageError(file.string() + " " + why + "; choose another folder with --out");
}

/// Files of a folder that is no rendered sequence are somebody's own: they are neither overwritten
/// nor mixed with this one's images. A killed run has left the truth half written.
void keep_files_of_others(const RenderOptions& options) {
    const fs::path out(options.out_dir);
    std::error_code error;
    const bool is_rendered = fs::exists(out / "truth.csv", error) ||
                             fs::exists(out / "truth.defrec-0.partial.csv", error);
    for (const char* name : {"calibration.yaml", "points.csv"}) {
        if (!is_rendered && fs::exists(out / name, error))
            refuse_file_of_others(out / name,
                                  "would be overwritten, which is of no rendered sequence");
    }
    for (const char* folder : {"left", "right", "disparity"}) {
        for (const auto& entry : fs::directory_iterator(out / folder, error)) {
            const std::string name = entry.path().filename().string();
            if (is_rendered && (is_frame_name(name) || name.find(".partial.") != std::string::npos))
                continue;
            refuse_file_of_others(
                entry.path(), "is of no rendered sequence and would be among this one's images");
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
    if (options.width < 160 || options.width > 3840 || options.height < 120 ||
        options.height > 2160) {
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
    const auto info = std::find_if(known.begin(), known.end(),
                                   [&](const SceneInfo& s) { return s.name == options.scene; });
    if (info == known.end()) {
        const std::string nearest = nearest_name(options.scene, scene_names());
        throw RenderUsageError("there is no scene named '" + options.scene + "'" +
                               (nearest.empty() ? "; " : "; did you mean " + nearest + "? ") +
                               "'defrec render --list' names all");
    }
    const int frames = options.frames > 0 ? options.frames : info->default_frames;
    const int threads = options.threads > 0
                            ? options.threads
                            : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    if (is_interlaced(options.fields) && (options.layout != "defrec" || options.depth)) {
        throw RenderUsageError("--interlaced is of the layout defrec, without --depth");
    }
    if (options.layout != "defrec") {
        const auto layouts = public_layouts();
        if (std::find(layouts.begin(), layouts.end(), options.layout) == layouts.end()) {
            throw RenderUsageError("there is no layout '" + options.layout + "'");
        }
        if (options.depth || !options.points_at.empty()) {
            throw RenderUsageError("--depth and --points-at are of the layout defrec");
        }
        return render_layout(options, frames, threads, progress, stop);
    }
    Sequence sequence(options, frames, threads);
    if (options.depth && !sequence.scene().info.rectified) {
        throw RenderUsageError("scene '" + options.scene +
                               "' has raw images; --depth is for rectified scenes only");
    }
    keep_files_of_others(options);
    make_folders(options);
    remove_leftovers(options, frames);
    try {
        return sequence.render(progress, stop);
    } catch (const FileError& error) {
        throw RenderOutputError(error.what());
    }
}

}  // namespace defrec::cli
