// Both views of a recording as H.264 videos, by OpenCV's FFmpeg.
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>

#include "sdk/base/os/atomic_file.hpp"

namespace defrec::cli {

// Used by one thread at a time.
class ViewVideos {
  public:
    // In the folder, under temporary names until finish(). size: even, as colour is at half size.
    // fps: what players are told, within what the encoder takes; times stand elsewhere.
    // Throws CliError(kUsage) for another size, and where OpenCV cannot encode H.264.
    ViewVideos(const std::filesystem::path& folder, cv::Size size, double fps);

    // Images of 8 bits, gray or BGR.
    void write(const cv::Mat& left, const cv::Mat& right);
    // Gives the files their names. Throws FileError, and CliError(kOutput) where a video has not
    // all images: give_up() then.
    void finish();
    // Returns how many pairs of images both begin with. Where there are any, the files get their
    // names as they are, unless they have them; files of none are removed. Throws FileError.
    std::int64_t give_up();

    std::uint64_t bytes() const;

  private:
    struct View {
        View(const std::filesystem::path& path, cv::Size size, double fps);
        void write(const cv::Mat& image);
        // Where the file is.
        const std::filesystem::path& path() const {
            return is_named ? file.path() : file.temporary();
        }

        AtomicFile file;
        cv::VideoWriter writer;
        cv::Mat colour;  // of a gray image
        bool is_named = false;
    };
    void close();

    View left_, right_;
    std::int64_t written_ = 0;
};

}  // namespace defrec::cli
