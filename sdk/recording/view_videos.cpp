// See view_videos.hpp.
#include "sdk/recording/view_videos.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>

#include "sdk/input/recorded_folder.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

// What FFmpeg's encoder and container take of any rate that can be stated.
constexpr double kMinFps = 0.01, kMaxFps = 240;

// Packets of a video, of which each has an image; nothing is decoded.
std::int64_t images_in(const fs::path& path) {
    constexpr int kUndecoded = -1;
    cv::VideoCapture video;
    if (!video.open(path.string(), cv::CAP_FFMPEG, {cv::CAP_PROP_FORMAT, kUndecoded})) return 0;
    std::int64_t count = 0;
    while (video.grab()) ++count;
    return count;
}

}  // namespace

ViewVideos::View::View(const fs::path& path, cv::Size size, double fps) : file(path) {
    if (size.width % 2 != 0 || size.height % 2 != 0)
        throw CliError(ExitCode::kUsage,
                       "--format h264: an even width and height were expected, "
                       "not " +
                           size_text(size.width, size.height) + "; take --format png.");
    bool is_open = false;
    try {
        is_open = writer.open(file.temporary().string(), cv::CAP_FFMPEG,
                              cv::VideoWriter::fourcc('H', '2', '6', '4'), fps, size);
    } catch (const cv::Exception&) {
        is_open = false;
    }
    if (!is_open)
        throw CliError(ExitCode::kUsage,
                       "--format h264: this OpenCV has no encoder of H.264, or cannot use it; "
                       "Debian's package libavcodec59 has one, of libx264-164. Take --format png "
                       "otherwise.");
}

void ViewVideos::View::write(const cv::Mat& image) {
    if (image.channels() == 1) cv::cvtColor(image, colour, cv::COLOR_GRAY2BGR);
    writer.write(image.channels() == 1 ? colour : image);
}

ViewVideos::ViewVideos(const fs::path& folder, cv::Size size, double fps)
    : left_(folder / kLeftVideo, size, std::clamp(fps, kMinFps, kMaxFps)),
      right_(folder / kRightVideo, size, std::clamp(fps, kMinFps, kMaxFps)) {}

void ViewVideos::write(const cv::Mat& left, const cv::Mat& right) {
    left_.write(left);
    right_.write(right);
    ++written_;
}

void ViewVideos::close() {
    for (View* view : {&left_, &right_}) view->writer.release();
}

// The writer tells no failure, as of a full disk.
void ViewVideos::finish() {
    close();
    for (const View* view : {&left_, &right_})
        if (written_ > 0 && images_in(view->path()) != written_)
            throw CliError(ExitCode::kOutput, view->file.path().string() + ": not all of " +
                                                  std::to_string(written_) +
                                                  " images are in the video; is the disk full?");
    if (written_ == 0) return;
    for (View* view : {&left_, &right_}) {
        view->file.commit();
        view->is_named = true;
    }
}

std::int64_t ViewVideos::give_up() {
    close();
    // Before so many images x264 gives out ones that are shown after them: where the video was cut
    // off, they may be missing.
    constexpr std::int64_t kReordered = 2;
    std::int64_t pairs = written_;
    for (const View* view : {&left_, &right_}) {
        const std::int64_t images = images_in(view->path());
        if (images != written_) pairs = std::min(pairs, images - kReordered);
    }
    pairs = std::max<std::int64_t>(pairs, 0);
    for (View* view : {&left_, &right_}) {
        if (pairs > 0 && !view->is_named) view->file.commit();
        view->is_named = view->is_named || pairs > 0;
    }
    return pairs;
}

std::uint64_t ViewVideos::bytes() const {
    std::uint64_t sum = 0;
    for (const View* view : {&left_, &right_}) {
        std::error_code error;
        const auto size = fs::file_size(view->file.path(), error);
        if (!error) sum += size;
    }
    return sum;
}

}  // namespace defrec::cli
