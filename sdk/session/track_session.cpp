// `defrec track`.
#include "sdk/session/track_session.hpp"

#include <array>
#include <chrono>
#include <cstdio>
#include <deque>
#include <exception>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/client/library.hpp"
#include "sdk/client/tracker_config.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/live_link/live_link.hpp"
#include "sdk/live_view/live_view.hpp"
#include "sdk/report/report.hpp"
#include "sdk/session/point_follower.hpp"
#include "sdk/session/real_time.hpp"
#include "sdk/session/result_record.hpp"
#include "sdk/session/target_follower.hpp"
#include "sdk/session/trace_file.hpp"
#include "sdk/session/track_summary.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFramesInFlight = 2;

cv::Mat left_image(const StereoFrame& frame) {
    return {frame.left.height, frame.left.width, CV_8UC(frame.left.channels),
            const_cast<std::uint8_t*>(frame.left.pixels), frame.left.stride};
}

// The writers of overlay and report fail with plain exceptions that stand for files that cannot be
// written.
template <typename Function>
void as_output(const Function& function) {
    try {
        function();
    } catch (const CliError&) {
        throw;
    } catch (const std::runtime_error& error) {
        throw CliError(ExitCode::kOutput, error.what());
    }
}

void check_frame_size(const FrameSource& source) {
    const int width = source.width(), height = source.height();
    if (width >= DEFREC_MIN_WIDTH && height >= DEFREC_MIN_HEIGHT && width <= DEFREC_MAX_SIDE &&
        height <= DEFREC_MAX_SIDE) {
        return;
    }
    throw CliError(ExitCode::kInput,
                   "the frames are " + std::to_string(width) + "x" + std::to_string(height) +
                       "; sizes from " + std::to_string(DEFREC_MIN_WIDTH) + "x" +
                       std::to_string(DEFREC_MIN_HEIGHT) + " to " +
                       std::to_string(DEFREC_MAX_SIDE) + " on a side are supported.");
}

StereoCalibration calibration_for(const TrackOptions& options, const FrameSource& source) {
    StereoCalibration calibration = load_calibration(options.calibration, options.units);
    fit_to_frames(calibration, source.width(), source.height());
    return calibration;
}

defrec_tracker_desc tracker_desc(const TrackOptions& options, const FrameSource& source) {
    auto desc = initialised<defrec_tracker_desc>();
    desc.seed = options.seed;
    desc.format = format_of_channels(source.channels());
    desc.frames_in_flight = kFramesInFlight;
    if (!options.config.empty()) read_config(options.config, desc);
    if (options.grow) desc.grow = 1;
    if (!options.trace.empty()) desc.timed = 1;
    return desc;
}

std::unique_ptr<LiveLink> open_link(const TrackOptions& options) {
    if (options.link.kind == LinkOptions::Kind::kNone) return nullptr;
    auto link = std::make_unique<LiveLink>(options.link);
    if (options.link.kind == LinkOptions::Kind::kListen && !options.quiet) {
        print_notice("live link: listening at " + to_string(link->endpoint()) + ".");
    }
    return link;
}

class TrackSession {
  public:
    explicit TrackSession(const TrackOptions& options)
        : options_(options),
          source_((source_is_given(options), options.source)),
          calibration_((check_frame_size(source_), calibration_for(options, source_))),
          desc_(tracker_desc(options, source_)),
          link_(open_link(options)),
          context_(open_context({options.threads, options.quiet, {}})),
          device_(choose_device(context_, options.backend, options.device)),
          rig_(make_rig(context_, calibration_)),
          projection_(rig_),
          followed_(points_to_follow()),
          given_targets_(targets_to_follow()),
          folder_((create_output_folder(options.out), options.out)),
          folder_lock_(folder_),
          points_(folder_ / "points.csv", followed_, rig_, projection_),
          progress_(options.quiet) {
        if (!given_targets_.empty())
            targets_.emplace(folder_ / kTargetsFile, std::move(given_targets_), projection_);
        desc_.device_id = device_.id.c_str();
        // Nobody asks for what lies beneath the surface.
        if (!targets_) desc_.body = DEFREC_BODY_OFF;
        defrec_tracker tracker = nullptr;
        require(defrec_tracker_create(context_.get(), rig_.get(), &desc_, &tracker),
                options_.config.empty() ? ExitCode::kInternal : ExitCode::kUsage,
                "creating the tracker");
        tracker_.reset(tracker);
        if (!options_.from_template.empty()) set_template();
        if (options_.meshes) create_output_folder(folder_ / "deformed");
        as_output([&] {
            if (!options_.trace.empty()) trace_.emplace(options_.trace, device_.id);
            open_report();
        });
        if (options_.view_port) open_view(*options_.view_port);
        source_.set_notice_handler([this](const std::string& notice) {
            if (options_.quiet) return;
            progress_.clear();
            print_notice(notice);
        });
    }

    int run() {
        const auto start = std::chrono::steady_clock::now();
        std::exception_ptr failure;
        try {
            track_all();
        } catch (const CliError&) {
            failure = std::current_exception();
        }
        pending_.clear();
        view_.reset();
        progress_.clear();
        const double seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        finish_link();
        finish(seconds, failure);
        if (failure) std::rethrow_exception(failure);
        return report_end();
    }

  private:
    void set_template() {
        defrec_template handle = nullptr;
        require(defrec_template_load(context_.get(), options_.from_template.c_str(), &handle),
                ExitCode::kInput, "reading the template");
        const Template surface(handle);
        require(defrec_tracker_set_template(tracker_.get(), surface.get()), ExitCode::kInput,
                "following the template of " + options_.from_template);
    }

    struct Pending {
        StereoFrame frame;
        Job job;
        TraceFile::Clock::time_point submitted{};
    };

    static void source_is_given(const TrackOptions& options) {
        const bool is_one = !options.source.stereo.empty();
        const bool is_two = !options.source.left.empty() && !options.source.right.empty();
        if (is_one == is_two) {
            throw CliError(ExitCode::kUsage,
                           "give the frames as --left P --right P, or as --stereo P --layout L.");
        }
    }

    std::vector<FollowedPoint> points_to_follow() const {
        return options_.points.empty()
                   ? grid_points(source_.width(), source_.height())
                   : read_points(options_.points, source_.width(), source_.height());
    }

    std::vector<Target> targets_to_follow() const {
        if (options_.targets.empty()) return {};
        const fs::path out = options_.out;
        keep_input(options_.targets,
                   {out / kTargetsFile, out / "points.csv", out / "frames.csv",
                    out / "summary.json", out / "template.ply", out / "overlay.mp4",
                    out / "report.html", options_.trace, options_.save_template});
        return read_targets(options_.targets);
    }

    const std::string& source_name() const {
        return options_.source.stereo.empty() ? options_.source.left : options_.source.stereo;
    }

    Projector projector() {
        return [this](const float* xyz, std::size_t count, float* uv) {
            projection_.project(xyz, count, uv);
        };
    }

    void open_view(std::uint16_t port) {
        // On the view's threads, so with memory of its own.
        auto projection = std::make_shared<RawProjection>(rig_);
        view_ = std::make_unique<LiveView>(
            port, ViewFacts{source_name(), device_.name, defrec_version_string()},
            [projection](const float* xyz, std::size_t count, float* uv) {
                projection->project(xyz, count, uv);
            });
        print_notice("live view: open " + view_->url());
    }

    void open_report() {
        ReportMeta meta;
        meta.sequence = source_name();
        meta.backend = device_.id;
        meta.device = device_.name;
        meta.version = defrec_version_string();
        meta.facts = {{"Calibration", options_.calibration},
                      {"Frame size",
                       std::to_string(source_.width()) + " x " + std::to_string(source_.height())},
                      {"Points", options_.points.empty() ? "a grid" : options_.points}};
        if (targets_) meta.facts.emplace_back("Targets", options_.targets);
        if (options_.overlay) {
            overlay_ =
                std::make_unique<OverlayWriter>(folder_ / "overlay.mp4", source_.width(),
                                                source_.height(), source_.fps(), projector());
            meta.overlay_file = overlay_->path().filename().string();
        }
        if (!options_.report) return;
        report_ = std::make_unique<ReportWriter>(folder_ / "report.html", meta, projector());
    }

    void track_all() {
        // In real time a result is taken before the next frame is waited for; a trace has to know
        // when the device turns to a frame.
        const bool has_pace = options_.realtime && !source_.is_live();
        const std::size_t max_pending =
            has_pace || source_.is_live() || trace_ ? 1 : kFramesInFlight;
        RealTime real_time;
        bool has_more = true;
        while (has_more || !pending_.empty()) {
            has_more = has_more && !interrupt_requested();
            if (has_more && pending_.size() < max_pending) {
                Pending next;
                const auto begin = TraceFile::Clock::now();
                has_more = source_.next(next.frame);
                if (!has_more) continue;
                trace_host("read", next.frame, begin, TraceFile::Clock::now());
                if (has_pace) real_time.wait_for(next.frame.timestamp_ms);
                const auto begin_submit = TraceFile::Clock::now();
                next.job = submit(tracker_, next.frame, options_.deadline_ns);
                next.submitted = TraceFile::Clock::now();
                trace_host("submit", next.frame, begin_submit, next.submitted);
                pending_.push_back(std::move(next));
                continue;
            }
            if (pending_.empty()) break;
            take_result(pending_.front());
            pending_.pop_front();
        }
    }

    void trace_host(const char* name, const StereoFrame& frame, TraceFile::Clock::time_point begin,
                    TraceFile::Clock::time_point end) {
        if (trace_) as_output([&] { trace_->add_host(name, frame.index, begin, end); });
    }

    void take_result(const Pending& pending) {
        const auto begin = TraceFile::Clock::now();
        require(defrec_job_wait(pending.job.get(), UINT64_MAX), ExitCode::kInternal,
                "frame " + std::to_string(pending.frame.index));
        const auto done = TraceFile::Clock::now();
        trace_host("wait", pending.frame, begin, done);
        auto result = initialised<defrec_result>();
        require(defrec_job_result(pending.job.get(), &result), ExitCode::kInternal,
                "reading the result");
        if (trace_)
            as_output(
                [&] { trace_->add_device(pending.frame.index, result, pending.submitted, done); });
        const cv::Mat left = left_image(pending.frame);
        if (result.template_epoch != template_epoch_) {
            template_epoch_ = result.template_epoch;
            const Template surface = template_of(pending.job);
            if (desc_.body == DEFREC_BODY_ON && !source_.is_live()) await_body(surface);
            const defrec_template_info info = info_of(surface);
            const TemplateRecord record = template_record(info, projection_);
            triangles_ = std::make_shared<const std::vector<std::uint32_t>>(record.triangles);
            if (!has_template_)
                take_template(pending.frame, left, surface, info, record);
            else
                as_output([&] { take_changed_template(record); });
        }

        if (!options_.from_template.empty() && !has_points_ && has_geometry(result)) {
            points_.begin_at(pending.frame.index);
            has_points_ = true;
        }
        if (view_) obey_view(pending.frame);
        const std::vector<PointRow> points =
            points_.add_frame(pending.frame.index, pending.frame.timestamp_ms,
                              has_geometry(result) ? pending.job.get() : nullptr);
        std::vector<TargetRow> targets;
        if (targets_) {
            targets = targets_->add_frame(pending.frame.index, pending.frame.timestamp_ms,
                                          has_geometry(result) ? pending.job.get() : nullptr);
        }
        if (link_) {
            link_->publish(link_frame(pending.frame, result, triangles_, points, targets));
            show_link_notices();
        }
        rows_.push_back(frame_row(pending.frame, result));
        reasons_ |= result.reasons;
        if (options_.meshes && has_geometry(result)) write_mesh(pending.frame.index, result);
        fill_record(rows_.back(), result, points, targets, projection_, record_);
        const auto drawing = TraceFile::Clock::now();
        as_output([&] {
            if (overlay_) overlay_->add(left, record_);
            if (report_) report_->add(left, record_);
            if (recording_) recording_->add(left, record_);
        });
        if (view_) view_->add(left, record_, view_points(points));
        const auto end = TraceFile::Clock::now();
        trace_host("overlay and report", pending.frame, drawing, end);
        trace_host("result", pending.frame, begin, end);
        progress_.update(static_cast<std::int64_t>(rows_.size()), source_.expected(),
                         rows_.back().state);
    }

    // What browsers asked for takes effect with this frame.
    void obey_view(const StereoFrame& frame) {
        for (const ViewCommand& command : view_->take_commands()) {
            if (command.kind == ViewCommand::Kind::kFollowPoint)
                points_.follow(command.u, command.v, frame.index);
            else if (command.is_on != (recording_ != nullptr))
                as_output([&] { command.is_on ? start_recording() : finish_recording(); });
        }
    }

    void start_recording() {
        std::array<char, 32> name{};
        std::snprintf(name.data(), name.size(), "recording_%03d.mp4", ++recordings_);
        recording_ = std::make_unique<OverlayWriter>(folder_ / name.data(), source_.width(),
                                                     source_.height(), source_.fps(), projector());
        if (has_template_) recording_->set_template(template_record_);
        view_->set_recording(recording_->path().filename().string());
    }

    void finish_recording() {
        if (!recording_) return;
        recording_->finish();
        recording_.reset();
        if (view_) view_->set_recording("");
    }

    static Template template_of(const Job& job) {
        defrec_template handle = nullptr;
        require(defrec_job_get_template(job.get(), &handle), ExitCode::kInternal,
                "reading the template");
        return Template(handle);
    }

    static defrec_template_info info_of(const Template& surface) {
        auto info = initialised<defrec_template_info>();
        require(defrec_template_get(surface.get(), &info), ExitCode::kInternal,
                "reading the template");
        return info;
    }

    // So that what is written depends on the frames alone, and not on when the body is ready.
    static void await_body(const Template& surface) {
        const defrec_status status = defrec_template_wait_body(surface.get(), UINT64_MAX);
        if (status != DEFREC_ERROR_UNSUPPORTED)
            require(status, ExitCode::kInternal, "computing the body beneath the surface");
    }

    void write_template(const defrec_template_info& info, const TemplateRecord& record) const {
        std::vector<float> normals;
        for (std::uint64_t i = 0; i < info.vertex_count; ++i) {
            normals.insert(normals.end(), info.vertices[i].normal, info.vertices[i].normal + 3);
        }
        write_ply(folder_ / "template.ply",
                  {record.vertices.data(), normals.data(), nullptr, nullptr, info.vertex_count,
                   record.triangles.data(), info.triangle_count});
    }

    // The parts that show it in pictures.
    void show_template(const TemplateRecord& record) {
        if (overlay_) overlay_->set_template(record);
        if (recording_) recording_->set_template(record);
        if (!view_) return;
        view_->set_template(record);
        template_record_ = record;
    }

    void take_changed_template(const TemplateRecord& record) {
        show_template(record);
        if (report_) report_->change_template(record);
    }

    void take_template(const StereoFrame& frame, const cv::Mat& left, const Template& surface,
                       const defrec_template_info& info, const TemplateRecord& record) {
        write_template(info, record);
        if (options_.from_template.empty()) points_.lift(surface, frame.index, desc_.grow != 0);
        if (targets_) targets_->prepare(surface);
        as_output([&] {
            show_template(record);
            if (report_) report_->set_template(record, left);
        });
        template_frame_ = frame.index;
        has_template_ = true;
        if (options_.from_template.empty() && frame.index != options_.source.range.first) {
            notes_.push_back("The first frame could not give a template; it was taken from frame " +
                             std::to_string(frame.index) +
                             ", and the points to follow were looked up there.");
            if (targets_) {
                notes_.push_back(
                    "The targets were taken to be given in the left rectified camera "
                    "of frame " +
                    std::to_string(frame.index) + ", the template's.");
            }
        }
    }

    // Of the whole run.
    void note_points() {
        if (const std::size_t count = points_.points_without_surface(); count > 0) {
            notes_.push_back(std::to_string(count) + " of " + std::to_string(points_.count()) +
                             " points to follow lie where the template has no surface; they are "
                             "lost in every frame.");
        }
    }

    // The template as it was at the end, with what joined it.
    void finish_template() {
        if (!has_template_) return;
        defrec_template handle = nullptr;
        require(defrec_tracker_get_template(tracker_.get(), &handle), ExitCode::kInternal,
                "reading the template");
        const Template surface(handle);
        const defrec_template_info info = info_of(surface);
        if (options_.grow) write_template(info, template_record(info, projection_));
        if (options_.save_template.empty()) return;
        require(defrec_template_save(surface.get(), options_.save_template.c_str()),
                ExitCode::kOutput, "saving the template");
    }

    void show_link_notices() {
        const std::vector<std::string> notices = link_->take_notices();
        if (options_.quiet || notices.empty()) return;
        progress_.clear();
        for (const std::string& notice : notices) print_notice(notice);
    }

    void finish_link() {
        if (!link_) return;
        link_facts_ = {link_->endpoint(), link_->finish()};
        show_link_notices();
        if (link_facts_->counts.receivers == 0) {
            notes_.push_back("The live link at " + to_string(link_->endpoint()) +
                             " reached nobody.");
        }
    }

    void write_mesh(std::int64_t frame, const defrec_result& result) {
        std::array<char, 32> name{};
        std::snprintf(name.data(), name.size(), "%06lld.ply", static_cast<long long>(frame));
        write_ply(folder_ / "deformed" / name.data(),
                  {result.vertices, result.normals, result.vertex_status, result.expected_error_mm,
                   result.vertex_count, triangles_->data(), triangles_->size() / 3});
    }

    // Writes what there is, also after a failure; the first file that cannot be written is
    // reported.
    void finish(double seconds, std::exception_ptr& failure) {
        if (!source_.fault().empty()) notes_.push_back(source_.fault());
        note_points();
        if (!has_template_)
            notes_.emplace_back("No frame could give a template; nothing was tracked.");
        if ((reasons_ & DEFREC_REASON_VIEWS_SWAPPED) != 0) {
            notes_.emplace_back("The two images look swapped; exchange --left and --right.");
        }
        if ((reasons_ & DEFREC_REASON_VIEW_LATE) != 0) {
            notes_.emplace_back(
                "In some frames left and right view were taken at different times; see "
                "view_lag_frames in frames.csv.");
        }
        if ((reasons_ & DEFREC_REASON_INTERLACED) != 0) {
            notes_.emplace_back(
                "In some frames the rows of an image are of two times, as those of interlaced "
                "video; choose a progressive mode of the camera, or deinterlace.");
        }
        if ((reasons_ & DEFREC_REASON_CALIBRATION) != 0) {
            notes_.emplace_back(
                "The calibration has drifted; calibrate anew, or set self_calibration: correct in "
                "--config. See rig_estimate in summary.json.");
        }
        if (interrupt_requested())
            notes_.emplace_back("Interrupted; the outputs hold the frames tracked until then.");
        const auto attempt = [&](const auto& function) {
            try {
                as_output(function);
            } catch (const CliError&) {
                if (!failure) failure = std::current_exception();
            }
        };
        attempt([&] { points_.commit(); });
        attempt([&] {
            if (targets_) targets_->commit();
        });
        attempt([&] { finish_template(); });
        attempt([&] {
            if (trace_) trace_->commit();
        });
        attempt([&] { write_frames(folder_ / "frames.csv", rows_); });
        attempt([&] { finish_recording(); });
        attempt([&] {
            if (!overlay_) return;
            overlay_->finish();
            if (!overlay_->note().empty()) notes_.push_back(overlay_->note());
            if (report_) report_->meta().overlay_file = overlay_->path().filename().string();
        });
        attempt([&] {
            if (!report_) return;
            report_->meta().notes.insert(report_->meta().notes.end(), notes_.begin(), notes_.end());
            report_->finish();
        });
        summary_ = summarise_track({options_, device_, calibration_, rig_info(rig_), rows_, points_,
                                    targets_ ? &*targets_ : nullptr, notes_,
                                    has_template_ ? std::optional(template_frame_) : std::nullopt,
                                    link_facts_, source_.camera_counts(), seconds});
        attempt([&] { write_atomically(folder_ / "summary.json", json_text(summary_, 2) + "\n"); });
    }

    int report_end() const {
        if (!options_.quiet) {
            for (const std::string& note : notes_) print_notice(note);
        } else if (!source_.fault().empty()) {
            print_notice(source_.fault());
        }
        if (options_.json) {
            print(json_text(summary_, 2) + "\n");
        } else if (!options_.quiet) {
            print(summary_text(summary_, folder_));
        }
        if (interrupt_requested()) return static_cast<int>(ExitCode::kInterrupted);
        return static_cast<int>(source_.fault().empty() ? ExitCode::kOk : ExitCode::kInput);
    }

    const TrackOptions options_;
    FrameSource source_;
    StereoCalibration calibration_;
    defrec_tracker_desc desc_;
    std::unique_ptr<LiveLink> link_;  // null where none was asked for
    Context context_;
    Device device_;
    Rig rig_;
    RawProjection projection_;
    std::vector<FollowedPoint> followed_;
    std::vector<Target> given_targets_;
    fs::path folder_;
    OutputFolderLock folder_lock_;
    PointFollower points_;
    std::optional<TargetFollower> targets_;  // empty where none were given
    ProgressBar progress_;
    Tracker tracker_;
    std::optional<TraceFile> trace_;
    std::unique_ptr<OverlayWriter> overlay_;    // null where none was asked for
    std::unique_ptr<ReportWriter> report_;      // null where none was asked for
    std::unique_ptr<OverlayWriter> recording_;  // null while none is made
    int recordings_ = 0;
    TemplateRecord template_record_;  // the present one, for recordings; only with a view
    std::unique_ptr<LiveView> view_;  // null where none was asked for
    std::deque<Pending> pending_;
    std::shared_ptr<const std::vector<std::uint32_t>>
        triangles_;  // shared with frames that wait to be sent
    std::vector<FrameRow> rows_;
    FrameRecord record_;
    std::vector<std::string> notes_;
    std::optional<LinkFacts> link_facts_;  // when the link has ended
    nlohmann::ordered_json summary_;
    std::int64_t template_frame_ = 0;
    std::uint32_t template_epoch_ = 0;
    bool has_template_ = false;
    bool has_points_ = false;    // their frame has come; of a template that was given
    std::uint32_t reasons_ = 0;  // of all frames
};

}  // namespace

int run_track(const TrackOptions& options) { return TrackSession(options).run(); }

}  // namespace defrec::cli
