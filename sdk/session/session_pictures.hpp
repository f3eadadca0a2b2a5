// What shows a tracked sequence in pictures: overlay.mp4, report.html, the live view and what is
// recorded from it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/live_view/live_view.hpp"
#include "sdk/report/report.hpp"
#include "sdk/report/told_state.hpp"
#include "sdk/session/input_checks.hpp"
#include "sdk/session/session_notes.hpp"
#include "sdk/session/view_recordings.hpp"

namespace defrec::cli {

struct PictureOptions {
    std::filesystem::path folder;
    int width = 0, height = 0;  // of the left image, px
    double fps = 0;
    Projector project;
    bool has_overlay = true, has_report = true;
    OverlayDetail detail = OverlayDetail::usual;
    bool leaves_out = false;  // pictures of a recording rather than wait for its encoder
};

// Functions that write throw CliError(ExitCode::kOutput) where a file cannot be written.
class SessionPictures {
  public:
    SessionPictures(PictureOptions options, ReportMeta meta);

    // project: on the view's threads, so with memory of its own.
    void open_view(std::uint16_t port, ViewFacts facts, Projector project);
    // A browser's command takes effect with this frame; commands about points are handed on.
    void obey_view(const std::function<void(const ViewCommand&)>& change_points);
    // The view shows what the doctor finds in the first frames and in the calibration, as its files
    // have it. camera: of the rectified views.
    void check_input(StereoCalibration calibration, const defrec_camera& camera);
    bool has_view() const { return view_ != nullptr; }
    // Browsers are told that the run has ended.
    void end_view() {
        if (view_) view_->end();
    }
    void close_view() {
        checks_.reset();
        view_.reset();
    }

    // left: the image that the template was taken of.
    void set_template(const TemplateRecord& record, const cv::Mat& left);
    void change_template(const TemplateRecord& record);
    void add(const cv::Mat& left, const FrameRecord& record);
    // See LiveView::add.
    void add_to_view(const cv::Mat& left, const FrameRecord& record, std::vector<ViewPoint> points,
                     std::size_t dropped_clicks);
    // See InputChecks.
    void add_to_checks(const StereoFrame& frame, const defrec_result& result,
                       const CompressionWatch& compression) {
        if (checks_) checks_->add(frame, result, compression);
    }

    void finish_recording();
    // The fate of recordings since the last call; the view tells it as well.
    std::vector<std::string> take_notes();
    // Names of the files that were finished.
    const std::vector<std::string>& written() const { return written_; }
    // Returns a note on the overlay, empty for none.
    std::string finish_overlay();
    // origin: of the template.
    void finish_report(const std::string& origin, const SessionNotes& notes);

  private:
    std::unique_ptr<OverlayWriter> open_overlay(const std::filesystem::path& path) const;
    void show_template(const TemplateRecord& record);

    const PictureOptions options_;
    std::unique_ptr<OverlayWriter> overlay_;  // null where none was asked for
    std::unique_ptr<ReportWriter> report_;    // null where none was asked for
    std::unique_ptr<LiveView> view_;          // null where none was asked for
    std::unique_ptr<InputChecks> checks_;     // for the view; ends before it
    ViewRecordings recordings_;
    ToldState told_state_;
    std::int64_t frames_ = 0;  // given so far: without any there is no file
    std::vector<std::string> written_;
    std::optional<TemplateRecord> template_;  // the present one, for recordings; only with a view
};

// Overlay and report fail with plain exceptions that stand for files that cannot be written.
void as_output(const std::function<void()>& function);

}  // namespace defrec::cli
