// Recordings from the live view: recording_001.mp4 and so on. A recording that fails is told
// of and ends; the run goes on.
#pragma once

#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/report/overlay.hpp"

namespace defrec::cli {

// One thread at a time.
class ViewRecordings {
  public:
    // Throws what OverlayWriter throws.
    using Open = std::function<std::unique_ptr<OverlayWriter>(const std::filesystem::path&)>;
    // leaves_out: pictures for which the encoder is not ready, instead of waiting for it.
    ViewRecordings(std::filesystem::path folder, Open open, bool leaves_out);

    // The next number that no file in the folder has. reference: the present template.
    void start(const std::optional<TemplateRecord>& reference);
    // Returns at once: the file is finished beside what follows.
    void stop();
    // Nothing where none is made.
    void set_template(const TemplateRecord& reference);
    // told: as OverlayPainter::draw.
    void add(const cv::Mat& left, const FrameRecord& record, std::string_view told = {});
    // The file of the recording that is made; empty: none is.
    std::string name() const;

    // Ends a recording, and returns once all files are finished.
    void finish();
    // Names of the files that were finished, after finish().
    const std::vector<std::string>& written() const { return written_; }
    // Failures, and pictures that are missing, since the last call.
    std::vector<std::string> take_notes();

  private:
    struct Recording {
        std::unique_ptr<OverlayWriter> video;
        std::int64_t pictures = 0, left_out = 0;
        std::future<void> end{};  // of what is done with the video, before which it does not go
        std::string name() const { return video->path().filename().string(); }
    };
    void guard(const std::function<void()>& function);
    void add_failure(const std::exception& error);
    void conclude(Recording& recording);
    std::string next_name();

    const std::filesystem::path folder_;
    const Open open_;
    const bool leaves_out_;
    std::optional<Recording> made_;
    std::vector<Recording> ending_;  // that are being finished
    int number_ = 0;
    std::vector<std::string> written_, notes_;
};

}  // namespace defrec::cli
