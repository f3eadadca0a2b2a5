// The live view of `defrec track`: a page in a browser of this computer that shows frames as they
// are tracked, and takes points to follow. Tracking never waits for it: a frame is copied only
// while a browser waits for one, and pictures are made on the server's threads.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sdk/live_view/view_frame.hpp"
#include "sdk/report/record.hpp"

namespace cv {
class Mat;
}

namespace defrec::cli {

// Texts for the head of the page.
struct ViewFacts {
    std::string sequence, device, version;
};

class LiveView {
  public:
    // Listens at 127.0.0.1; port 0: any that is free. projector is called on the view's threads,
    // one call at a time. Throws CliError(kOutput) where nothing can listen.
    LiveView(std::uint16_t port, ViewFacts facts, Projector projector);
    // As end(); where pages watch, up to 2 s later, so that each hears of the end.
    ~LiveView();
    LiveView(const LiveView&) = delete;
    LiveView& operator=(const LiveView&) = delete;

    // What to open: http://127.0.0.1:PORT/?token=TOKEN.
    const std::string& url() const;

    // One thread at a time, the tracking's, for all that follows.
    void set_template(const TemplateRecord& reference);
    // left: CV_8UC1 or CV_8UC3. dropped_clicks: of the run so far, those without a surface.
    void add(const cv::Mat& left, const FrameRecord& frame, std::vector<ViewPoint> points,
             std::size_t dropped_clicks = 0);
    // The name of the file that is recorded, empty while none is.
    void set_recording(const std::string& name);
    // Pages that watch say it for a few seconds.
    void tell(const std::string& message);
    // What the video and the calibration have wrong: JSON, as `defrec doctor --json` prints it. Any
    // thread.
    void set_checks(std::string checks);
    // Pages say that the run has ended, and get nothing more.
    void end();
    // After end(): returns once each page that watches has been told of it, or after that time.
    void wait_for_pages(std::chrono::milliseconds most);
    // What browsers asked for since the last call.
    std::vector<ViewCommand> take_commands();
    // Browsers that wait for a frame now. Any thread.
    int waiting() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace defrec::cli
