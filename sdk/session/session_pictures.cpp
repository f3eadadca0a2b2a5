// See session_pictures.hpp.
#include "sdk/session/session_pictures.hpp"

#include <array>
#include <cstdio>
#include <stdexcept>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/terminal.hpp"

namespace defrec::cli {

void as_output(const std::function<void()>& function) {
    try {
        function();
    } catch (const CliError&) {
        throw;
    } catch (const std::runtime_error& error) {
        throw CliError(ExitCode::kOutput, error.what());
    }
}

SessionPictures::SessionPictures(PictureOptions options, ReportMeta meta)
    : options_(std::move(options)) {
    as_output([&] {
        if (options_.has_overlay) {
            overlay_ = open_overlay("overlay.mp4");
            meta.overlay_file = overlay_->path().filename().string();
        }
        if (options_.has_report)
            report_ = std::make_unique<ReportWriter>(options_.folder / "report.html", meta,
                                                     options_.project, options_.detail);
    });
}

std::unique_ptr<OverlayWriter> SessionPictures::open_overlay(const std::string& name) const {
    return std::make_unique<OverlayWriter>(options_.folder / name, options_.width, options_.height,
                                           options_.fps, options_.project, options_.detail);
}

void SessionPictures::open_view(std::uint16_t port, ViewFacts facts, Projector project) {
    view_ = std::make_unique<LiveView>(port, std::move(facts), std::move(project));
    print_notice("live view: open " + view_->url());
}

void SessionPictures::check_input(StereoCalibration calibration, const defrec_camera& camera) {
    checks_ = std::make_unique<InputChecks>(
        std::move(calibration), camera,
        [view = view_.get()](std::string checks) { view->set_checks(std::move(checks)); });
}

void SessionPictures::obey_view(const std::function<void(const ViewCommand&)>& change_points) {
    if (!view_) return;
    for (const ViewCommand& command : view_->take_commands()) {
        if (command.kind != ViewCommand::Kind::kRecord)
            change_points(command);
        else if (command.is_on != (recording_ != nullptr))
            as_output([&] { command.is_on ? start_recording() : finish_recording(); });
    }
}

void SessionPictures::start_recording() {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "recording_%03d.mp4", ++recordings_);
    recording_ = open_overlay(name.data());
    recorded_from_ = frames_;
    if (template_) recording_->set_template(*template_);
    view_->set_recording(recording_->path().filename().string());
}

void SessionPictures::finish_recording() {
    if (!recording_) return;
    recording_->finish();
    if (frames_ > recorded_from_) written_.push_back(recording_->path().filename().string());
    recording_.reset();
    if (view_) view_->set_recording("");
}

void SessionPictures::show_template(const TemplateRecord& record) {
    if (overlay_) overlay_->set_template(record);
    if (recording_) recording_->set_template(record);
    if (!view_) return;
    view_->set_template(record);
    template_ = record;
}

void SessionPictures::set_template(const TemplateRecord& record, const cv::Mat& left) {
    as_output([&] {
        show_template(record);
        if (report_) report_->set_template(record, left);
    });
}

void SessionPictures::change_template(const TemplateRecord& record) {
    as_output([&] {
        show_template(record);
        if (report_) report_->change_template(record);
    });
}

void SessionPictures::add(const cv::Mat& left, const FrameRecord& record) {
    as_output([&] {
        if (overlay_) overlay_->add(left, record);
        if (report_) report_->add(left, record);
        if (recording_) recording_->add(left, record);
    });
    ++frames_;
}

void SessionPictures::add_to_view(const cv::Mat& left, const FrameRecord& record,
                                  std::vector<ViewPoint> points, std::size_t dropped_clicks) {
    if (view_) view_->add(left, record, std::move(points), dropped_clicks);
}

std::string SessionPictures::finish_overlay() {
    if (!overlay_) return {};
    overlay_->finish();
    if (frames_ > 0) written_.push_back(overlay_->path().filename().string());
    if (report_) report_->meta().overlay_file = overlay_->path().filename().string();
    return overlay_->note();
}

void SessionPictures::finish_report(const std::string& origin, const SessionNotes& notes) {
    if (!report_) return;
    report_->meta().facts.emplace_back("Template", origin);
    for (std::size_t i = 0; i < notes.all().size(); ++i)
        report_->meta().notes.push_back(
            {static_cast<ReportSeverity>(notes.severities()[i]), notes.all()[i]});
    report_->finish();
    written_.emplace_back("report.html");
}

}  // namespace defrec::cli
