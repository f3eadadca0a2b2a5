// Encodes the painted frames and checks that the file reads back.
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <utility>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/io/whole_video.hpp"
#include "sdk/report/overlay.hpp"
#include "sdk/report/video_encoder.hpp"

namespace defrec::cli {
namespace {

struct Codec {
    const char* fourcc;
    const char* extension;  // nullptr: the one asked for
    const char* name;
};

constexpr Codec kCodecs[] = {{"avc1", nullptr, "H.264"},
                             {"mp4v", nullptr, "MPEG-4 part 2"},
                             {"VP80", ".webm", "VP8"},
                             {"MJPG", ".avi", "Motion JPEG"}};

int fourcc(const char* code) { return cv::VideoWriter::fourcc(code[0], code[1], code[2], code[3]); }

}  // namespace

struct OverlayWriter::Impl {
    OverlayPainter painter;
    std::unique_ptr<AtomicFile> file;
    std::unique_ptr<VideoEncoder> encoder;
    cv::Size image_size, video_size;
    std::int64_t frames = 0;
    std::string note;

    Impl(Projector projector, OverlayDetail detail) : painter(std::move(projector), detail) {}
    void open(const std::filesystem::path& path, double fps);
    cv::Mat painted(const cv::Mat& left, const FrameRecord& frame, std::string_view told);
    void check_readable() const;
};

void OverlayWriter::Impl::open(const std::filesystem::path& path, double fps) {
    for (const Codec& codec : kCodecs) {
        std::filesystem::path name = path;
        if (codec.extension) name.replace_extension(codec.extension);
        file.reset();
        file = std::make_unique<AtomicFile>(name);
        encoder = std::make_unique<VideoEncoder>(file->temporary().string(), fourcc(codec.fourcc),
                                                 fps, video_size);
        if (!encoder->opened()) {
            encoder.reset();
            continue;
        }
        if (&codec != &kCodecs[0])
            note = "This OpenCV cannot encode H.264; the overlay is " + std::string(codec.name) +
                   " in '" + name.filename().string() + "'.";
        return;
    }
    throw std::runtime_error(
        "cannot write '" + path.string() +
        "': this OpenCV has no video encoder (Debian's libopencv-dev with ffmpeg has); "
        "--no-overlay goes without");
}

cv::Mat OverlayWriter::Impl::painted(const cv::Mat& left, const FrameRecord& frame,
                                     std::string_view told) {
    cv::Mat canvas = encoder->blank();
    cv::Mat picture = canvas(cv::Rect(cv::Point(0, 0), image_size));
    if (left.channels() == 1)
        cv::cvtColor(left, picture, cv::COLOR_GRAY2BGR);
    else
        left.copyTo(picture);
    painter.draw(picture, frame, told);
    const cv::Size odd = video_size - image_size;
    if (odd.width)
        picture.col(picture.cols - 1).copyTo(canvas.col(picture.cols).rowRange(0, picture.rows));
    if (odd.height) canvas.row(picture.rows - 1).copyTo(canvas.row(picture.rows));
    return canvas;
}

void OverlayWriter::Impl::check_readable() const {
    const std::int64_t readable = readable_frames(file->temporary().string());
    if (readable != frames)
        throw std::runtime_error("cannot write '" + file->path().string() +
                                 "': the video is incomplete (" + std::to_string(readable) +
                                 " of " + std::to_string(frames) + " frames); is the disk full?");
}

OverlayWriter::OverlayWriter(const std::filesystem::path& path, int width, int height, double fps,
                             Projector projector, OverlayDetail detail)
    : impl_(std::make_unique<Impl>(std::move(projector), detail)) {
    if (width < 16 || height < 16)
        throw std::runtime_error("overlay: images of at least 16 x 16 pixels are needed, got " +
                                 std::to_string(width) + " x " + std::to_string(height));
    impl_->image_size = {width, height};
    // Chroma of the common pixel format is at half size, so an odd side gets one repeated column or
    // row.
    impl_->video_size = {width + width % 2, height + height % 2};
    impl_->open(path, std::isfinite(fps) && fps > 0 && fps <= 1000 ? fps : 25.0);
}

OverlayWriter::~OverlayWriter() = default;

void OverlayWriter::set_template(const TemplateRecord& reference) {
    impl_->painter.set_template(reference);
}

void OverlayWriter::add(const cv::Mat& left_bgr, const FrameRecord& frame, std::string_view told) {
    Impl& impl = *impl_;
    if (left_bgr.size() != impl.image_size ||
        (left_bgr.type() != CV_8UC3 && left_bgr.type() != CV_8UC1))
        throw std::runtime_error("overlay: frame " + std::to_string(frame.index) + " is " +
                                 std::to_string(left_bgr.cols) + " x " +
                                 std::to_string(left_bgr.rows) + " where an 8-bit image of " +
                                 std::to_string(impl.image_size.width) + " x " +
                                 std::to_string(impl.image_size.height) + " was expected");
    try {
        impl.encoder->push(impl.painted(left_bgr, frame, told));
    } catch (const std::exception& error) {
        throw std::runtime_error("cannot write '" + path().string() + "': " + error.what());
    }
    ++impl.frames;
}

bool OverlayWriter::is_behind() const { return impl_->encoder->is_full(); }

void OverlayWriter::finish() {
    Impl& impl = *impl_;
    try {
        impl.encoder->finish();
    } catch (const std::exception& error) {
        throw std::runtime_error("cannot write '" + path().string() + "': " + error.what());
    }
    if (impl.frames == 0) return;
    impl.check_readable();
    impl.file->commit();
}

const std::filesystem::path& OverlayWriter::path() const { return impl_->file->path(); }
const std::string& OverlayWriter::note() const { return impl_->note; }

}  // namespace defrec::cli
