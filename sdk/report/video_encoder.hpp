// Encodes video on a thread of low priority, so that the encoder's work (tens of milliseconds a
// frame) does not stand in the way of the tracking that runs beside it.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <opencv2/core.hpp>
#include <string>
#include <thread>
#include <vector>

namespace defrec::cli {

class VideoEncoder {
  public:
    /// Opens the file through OpenCV's ffmpeg. opened() tells whether that went well. Throws
    /// CliError where no thread can be started.
    VideoEncoder(const std::string& path, int fourcc, double fps, cv::Size size);
    /// Encodes what is queued, then closes the file.
    ~VideoEncoder();
    VideoEncoder(const VideoEncoder&) = delete;
    VideoEncoder& operator=(const VideoEncoder&) = delete;

    bool opened() const { return opened_; }

    /// A picture to draw on and hand back to push(); its content is undefined.
    cv::Mat blank();

    /// Whether push() would wait.
    bool is_full() const;

    /// Takes the picture; waits while the queue is full. Throws std::runtime_error if encoding
    /// failed before.
    void push(cv::Mat picture);

    /// Encodes what is queued and closes the file. Throws as push(). May be called once.
    void finish();

  private:
    static constexpr std::size_t kQueued = 4;

    void run(const std::string& path, int fourcc, double fps);
    void join();

    cv::Size size_;
    bool opened_ = false;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<cv::Mat> queue_;  // guarded by mutex_, as all below
    std::vector<cv::Mat> spare_;
    std::string failure_;
    bool ready_ = false, ending_ = false;
    std::thread thread_;
};

}  // namespace defrec::cli
