// See session_pictures.hpp.
#include "sdk/session/session_pictures.hpp"

#include <stdexcept>
#include <utility>

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
    : options_(std::move(options)),
      recordings_(
          options_.folder, [this](const std::filesystem::path& path) { return open_overlay(path); },
          options_.leaves_out) {
    as_output([&] {
        if (options_.has_overlay) {
            overlay_ = open_overlay(options_.folder / "overlay.mp4");
            meta.overlay_file = overlay_->path().filename().string();
        }
        if (options_.has_report)
            report_ = std::make_unique<ReportWriter>(options_.folder / "report.html", meta,
                                                     options_.project, options_.detail);
    });
}

std::unique_ptr<OverlayWriter> SessionPictures::open_overlay(
    const std::filesystem::path& path) const {
    return std::make_unique<OverlayWriter>(path, options_.width, options_.height, options_.fps,
                                           options_.project, options_.detail);
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
        else if (command.is_on == recordings_.name().empty())
            command.is_on ? recordings_.start(template_) : recordings_.stop();
    }
    view_->set_recording(recordings_.name());
}

void SessionPictures::finish_recording() {
    recordings_.finish();
    written_.insert(written_.end(), recordings_.written().begin(), recordings_.written().end());
}

std::vector<std::string> SessionPictures::take_notes() {
    std::vector<std::string> notes = recordings_.take_notes();
    if (view_ && !notes.empty()) view_->tell(notes.back());
    return notes;
}

void SessionPictures::show_template(const TemplateRecord& record) {
    if (overlay_) overlay_->set_template(record);
    recordings_.set_template(record);
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
    const std::string told = told_state_.take(record);
    as_output([&] {
        if (overlay_) overlay_->add(left, record, told);
        if (report_) report_->add(left, record);
    });
    recordings_.add(left, record, told);
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
