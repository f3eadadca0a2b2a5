// The images of one view, one after the other: from a video file, a folder in name order, or a
// numbered pattern.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cv {
class Mat;
}

namespace defrec::cli {

// One thread at a time.
class ImageStream {
  public:
    // `source`: a video file, a folder of images, or a path with one %d, %4d or %06d in its file
    // name. UTF-8. Throws CliError(kInput) when there is nothing to read.
    static std::unique_ptr<ImageStream> open(const std::string& source);
    virtual ~ImageStream() = default;

    // The next image, CV_8UC1 or CV_8UC3 (BGR); false at the end, and after a fault.
    virtual bool read(cv::Mat& image) = 0;
    // Passes over one image; false at the end, and after a fault.
    virtual bool skip() = 0;

    // What kept the stream from delivering all that it claims; empty if nothing did.
    const std::string& fault() const { return fault_; }
    const std::string& source() const { return source_; }
    // How many images the source says it has; not always true of a video.
    std::optional<std::int64_t> claimed() const { return claimed_; }
    // Images per second; 0 when the source does not say.
    double fps() const { return fps_; }
    // For folders and patterns, the files in order.
    virtual const std::vector<std::filesystem::path>& files() const = 0;

  protected:
    std::string source_, fault_;
    std::optional<std::int64_t> claimed_;
    double fps_ = 0;
};

}  // namespace defrec::cli
