// The encoder's thread and its queue.
#include "sdk/report/video_encoder.hpp"

#include <exception>
#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "sdk/io/exit_code.hpp"
#include "sdk/report/platform.hpp"

#ifdef __SANITIZE_THREAD__
// ThreadSanitizer sees only half of what libraries that were not built with it do: ffmpeg's and
// x264's atomics, and the locks that GDAL takes when OpenCV's imgcodecs starts it. The function's
// name is the sanitizer's.
extern "C" __attribute__((visibility("default"))) const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
    return "race:libavcodec.so\nrace:libavutil.so\nrace:libavformat.so\nrace:libswscale.so\nrace:"
           "libx264.so\n"
           "deadlock:libgdal.so\n";
}
#endif

namespace defrec::cli {

VideoEncoder::VideoEncoder(const std::string& path, int fourcc, double fps, cv::Size size)
    : size_(size) {
    try {
        thread_ = std::thread([this, path, fourcc, fps] { run(path, fourcc, fps); });
    } catch (const std::system_error& error) {
        throw CliError(ExitCode::kInternal, "a thread cannot be started (" +
                                                error.code().message() +
                                                "); memory or the number of threads is limited.");
    }
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ready_; });
}

VideoEncoder::~VideoEncoder() { join(); }

void VideoEncoder::run(const std::string& path, int fourcc, double fps) {
    // Before the encoder starts its own threads: they inherit it.
    lower_this_threads_priority();
    cv::VideoWriter video;
    std::string failure;
    const auto guarded = [&failure](auto&& action) {
        try {
            if (failure.empty()) action();
        } catch (const std::exception& error) {
            failure = error.what();
        }
    };
    bool opened = false;
    guarded([&] { opened = video.open(path, cv::CAP_FFMPEG, fourcc, fps, size_); });

    std::unique_lock lock(mutex_);
    opened_ = opened;
    ready_ = true;
    changed_.notify_all();
    for (;;) {
        changed_.wait(lock, [this] { return ending_ || !queue_.empty(); });
        if (queue_.empty()) break;
        cv::Mat picture = std::move(queue_.front());
        queue_.pop_front();
        lock.unlock();
        guarded([&] { video.write(picture); });
        lock.lock();
        spare_.push_back(std::move(picture));
        failure_ = failure;
        changed_.notify_all();
    }
    lock.unlock();
    guarded([&] { video.release(); });
    lock.lock();
    failure_ = failure;
}

cv::Mat VideoEncoder::blank() {
    const std::lock_guard lock(mutex_);
    if (spare_.empty()) return cv::Mat(size_, CV_8UC3);
    cv::Mat picture = std::move(spare_.back());
    spare_.pop_back();
    return picture;
}

bool VideoEncoder::is_full() const {
    const std::lock_guard lock(mutex_);
    return queue_.size() >= kQueued;
}

void VideoEncoder::push(cv::Mat picture) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return queue_.size() < kQueued; });
    if (!failure_.empty()) throw std::runtime_error(failure_);
    queue_.push_back(std::move(picture));
    changed_.notify_all();
}

void VideoEncoder::finish() {
    join();
    if (!failure_.empty()) throw std::runtime_error(failure_);
}

void VideoEncoder::join() {
    {
        const std::lock_guard lock(mutex_);
        ending_ = true;
        changed_.notify_all();
    }
    if (thread_.joinable()) thread_.join();
}

}  // namespace defrec::cli
