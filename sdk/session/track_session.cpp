// `defrec track`.
#include "sdk/session/track_session.hpp"

#include <algorithm>
#include <chrono>
#include <deque>
#include <exception>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/base/os/stdio_file.hpp"
#include "sdk/client/library.hpp"
#include "sdk/client/tracker_config.hpp"
#include "sdk/input/bag_calibration.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"
#include "sdk/live_link/link_clock.hpp"
#include "sdk/live_link/live_link.hpp"
#include "sdk/session/camera_trajectory.hpp"
#include "sdk/session/decisions.hpp"
#include "sdk/session/display_prediction.hpp"
#include "sdk/session/output_checks.hpp"
#include "sdk/session/plan_follower.hpp"
#include "sdk/session/point_follower.hpp"
#include "sdk/session/real_time.hpp"
#include "sdk/session/result_record.hpp"
#include "sdk/session/run_name.hpp"
#include "sdk/session/session_notes.hpp"
#include "sdk/session/session_pictures.hpp"
#include "sdk/session/target_follower.hpp"
#include "sdk/session/template_search.hpp"
#include "sdk/session/trace_file.hpp"
#include "sdk/session/track_summary.hpp"
#include "sdk/session/written_files.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFramesInFlight = 2;

void check_frame_size(const FrameSource& source) {
    const int width = source.width(), height = source.height();
    if (width >= DEFREC_MIN_WIDTH && height >= DEFREC_MIN_HEIGHT && width <= DEFREC_MAX_SIDE &&
        height <= DEFREC_MAX_SIDE) {
        return;
    }
    throw CliError(ExitCode::kInput,
                   "the frames are " + size_text(width, height) + "; sizes from " +
                       std::to_string(DEFREC_MIN_WIDTH) + "x" + std::to_string(DEFREC_MIN_HEIGHT) +
                       " to " + std::to_string(DEFREC_MAX_SIDE) + " on a side are supported.");
}

// Images that hold both views, and whose halves the calibration does not fit, may be cut the other
// way, or show one view.
void check_layout(const SourceOptions& options, const FrameSource& source,
                  const StereoCalibration& calibration) {
    if (options.stereo.empty() && !options.bag.has_stereo_images) return;
    const bool is_wide = options.layout == Layout::kSideBySide;
    const int width = source.width(), height = source.height();
    const int whole_width = is_wide ? 2 * width : width,
              whole_height = is_wide ? height : 2 * height;
    const auto is_for = [&](int its_width, int its_height) {
        return calibration.width == its_width && calibration.height == its_height;
    };
    std::string why;
    if (is_for(whole_width, whole_height))
        why = "it fits the whole images: if they show one view, give the sources of both.";
    else if (is_wide && is_for(whole_width, whole_height / 2))
        why = "it fits --layout top-bottom.";
    else if (!is_wide && is_for(whole_width / 2, whole_height))
        why = "it fits --layout side-by-side.";
    if (why.empty()) return;
    throw CliError(ExitCode::kCalibration,
                   "the calibration is for " + size_text(calibration.width, calibration.height) +
                       ", but by --layout " + layout_name(options.layout) + " each view is " +
                       size_text(width, height) + "; " + why);
}

StereoCalibration calibration_for(const WrittenCalibration& written, const TrackOptions& options,
                                  const FrameSource& source) {
    StereoCalibration calibration = load_calibration(written, options.units);
    check_layout(options.source, source, calibration);
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
    if (!options.recordings.trace.empty()) desc.timed = 1;
    if (options.view_port) desc.keep_disparity = 1;  // for the view's checks
    return desc;
}

void expect_source(const TrackOptions& options) {
    if (!options.source.has_views()) {
        throw CliError(ExitCode::kUsage,
                       "give the frames as --left P --right P, as --stereo P --layout L, as "
                       "--recording DIR, or as --bag P.");
    }
}

// What is to be followed. Read before anything is written.
struct Followed {
    Followed(const TrackOptions& options, const FrameSource& source)
        : points(options.points.empty()
                     ? grid_points(source.width(), source.height())
                     : read_points(options.points, source.width(), source.height())) {
        points_of_first = !options.points.empty() &&
                          std::any_of(points.begin(), points.end(),
                                      [](const FollowedPoint& point) { return !point.frame; });
        if (!options.targets.empty()) targets = read_targets(options.targets);
        if (!options.plan.file.empty()) expect_plan_file(options.plan.file);
    }

    std::vector<FollowedPoint> points;
    bool points_of_first = false;  // any are given in the first image
    std::vector<Target> targets;
};

Template template_of(const Job& job) {
    defrec_template handle = nullptr;
    require(defrec_job_get_template(job.get(), &handle), ExitCode::kInternal,
            "reading the template");
    return Template(handle);
}

// So that what is written depends on the frames alone, and not on when the body is ready.
void await_body(const Template& surface) {
    const defrec_status status = defrec_template_wait_body(surface.get(), UINT64_MAX);
    if (status != DEFREC_ERROR_UNSUPPORTED)
        require(status, ExitCode::kInternal, "computing the body beneath the surface");
}

// The live link, where one was asked for.
class LinkOutput {
  public:
    LinkOutput(const TrackOptions& options, ProgressBar& progress)
        : is_quiet_(options.quiet), progress_(progress), clock_(options.link.has_system_clock) {
        if (options.link.kind == LinkOptions::Kind::kNone) return;
        link_ = std::make_unique<LiveLink>(options.link);
        if (options.link.kind == LinkOptions::Kind::kListen && !is_quiet_)
            print_notice("live link: listening at " + to_string(link_->endpoint()) + ".");
    }
    bool is_open() const { return link_ != nullptr; }
    // A frame was taken from the input.
    void take(std::int64_t timestamp_ns) { clock_.take(timestamp_ns); }
    void publish(LinkFrame frame) {
        frame.timestamp_ns = clock_.stamp(frame.timestamp_ns);
        link_->publish(std::move(frame));
        show_notices();
    }
    void finish(SessionNotes& notes) {
        if (!link_) return;
        facts_ = {link_->endpoint(), link_->finish()};
        show_notices();
        if (facts_->counts.receivers == 0)
            notes.add("The live link at " + to_string(link_->endpoint()) + " reached nobody.");
    }
    // When the link has ended.
    const std::optional<LinkFacts>& facts() const { return facts_; }

  private:
    void show_notices() {
        const std::vector<std::string> notices = link_->take_notices();
        if (is_quiet_ || notices.empty()) return;
        progress_.clear();
        for (const std::string& notice : notices) print_notice(notice);
    }

    const bool is_quiet_;
    ProgressBar& progress_;
    LinkClock clock_;
    std::unique_ptr<LiveLink> link_;
    std::optional<LinkFacts> facts_;
};

// The library, set up for the source's frames.
struct Setup {
    Setup(const TrackOptions& options, const StereoCalibration& calibration)
        : context(open_context({options.threads, options.quiet, {}, nullptr, &remarks})),
          device(choose_device(context, options.backend, options.device)),
          rig(make_rig(context, calibration)),
          projection(rig) {}

    LibraryRemarks remarks;
    Context context;
    Device device;
    Rig rig;
    RawProjection projection;
};

// Targets and plans: they are followed, and nobody sees them.
struct Beneath {
    std::optional<TargetFollower> targets;  // empty where none were given
    std::optional<PlanFollower> plan;       // likewise

    bool is_asked_for() const { return targets || plan; }
    void forget_template() {
        if (targets) targets->forget_template();
        if (plan) plan->forget_template();
    }
    bool any_position() const {
        return (targets && targets->rows().any_position()) ||
               (plan && (plan->target_rows().any_position() || plan->part_rows().any_position()));
    }
};

class TrackSession {
  public:
    explicit TrackSession(const TrackOptions& options)
        : options_(options),
          source_((expect_source(options), check_outputs(options), options.source)),
          written_((check_frame_size(source_),
                    written_calibration(options.source, options.calibration))),
          calibration_(calibration_for(written_, options, source_)),
          desc_(tracker_desc(options, source_)),
          progress_(options.quiet),
          link_(options, progress_),
          setup_(options, calibration_),
          followed_(options, source_),
          folder_(options.out),
          points_((folder_.forget(kSummaryFile), folder_ / kPointsFile),
                  std::move(followed_.points), setup_.rig, setup_.projection) {
        options_.source.fields = source_.fields();
        notes_.add_fields(source_.fields());
        notes_.add_source(options_.source);
        notes_.add(source_.pairing_remark());
        notes_.add_self_calibration(desc_.self_calibration);
        if (!followed_.targets.empty())
            beneath_.targets.emplace(folder_ / kTargetsFile, std::move(followed_.targets),
                                     setup_.projection);
        if (!options_.plan.file.empty())
            beneath_.plan.emplace(folder_.path(), options_.plan, setup_.projection);
        if (options_.display_delay_ms)
            display_.emplace(folder_ / kDisplayFile, *options_.display_delay_ms, setup_.projection);
        create_tracker();
        notes_.add_frame_of_points(options_.source.range.first, followed_.points_of_first);
        if (options_.recordings.meshes) empty_mesh_folder(folder_ / kMeshFolder);
        as_output([&] {
            if (!options_.recordings.trace.empty())
                trace_.emplace(options_.recordings.trace, setup_.device.id);
        });
        pictures_ = open_pictures();
        if (options_.view_port) open_view(*options_.view_port);
        source_.set_notice_handler([this](const std::string& notice) { say(notice); });
    }

    int run() {
        const auto start = std::chrono::steady_clock::now();
        std::exception_ptr failure;
        try {
            track_all();
        } catch (const std::exception&) {
            failure = std::current_exception();
        }
        pending_.clear();
        pictures_->end_view();
        progress_.clear();
        const double seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        link_.finish(notes_);
        const nlohmann::ordered_json summary = finish(seconds, failure);
        // Whoever is connected to it waits, and not the outputs.
        pictures_->close_view();
        if (failure) std::rethrow_exception(failure);
        return report_end(summary);
    }

  private:
    struct Pending {
        StereoFrame frame;
        Job job;
        TraceFile::Clock::time_point submitted{};
    };
    // The tracker's present one.
    struct SeenTemplate {
        std::uint32_t epoch = 0;
        std::optional<std::int64_t> frame;  // that gave it, before it grew
        // Shared with frames that wait to be sent.
        std::shared_ptr<const std::vector<std::uint32_t>> triangles;
        CameraTrajectory trajectory;  // in its frame
        bool has_grid = false;        // the grid's frame has come; where the template was given
        bool is_another = false;      // after one that was given up, with what was found on it
    };

    void create_tracker() {
        desc_.device_id = setup_.device.id.c_str();
        // Nobody asks for what lies beneath the surface.
        if (!beneath_.is_asked_for()) desc_.body = DEFREC_BODY_OFF;
        const ExitCode refusal = options_.config.empty() ? ExitCode::kInternal : ExitCode::kUsage;
        if (!is_loaded()) found_ = search_template(refusal);
        defrec_tracker tracker = nullptr;
        require(defrec_tracker_create(setup_.context.get(), setup_.rig.get(), &desc_, &tracker),
                refusal, "creating the tracker");
        tracker_.reset(tracker);
        if (found_) {
            follow(found_->surface, "frame " + std::to_string(found_->frame.index));
            if (beneath_.plan) beneath_.plan->prepare(found_->surface);
            points_.follow_back_from(found_->frame.index);
            go_back();
        }
        if (!is_loaded()) return;
        const Template surface = load_template(setup_.context, options_.surface.load);
        if (beneath_.plan) beneath_.plan->prepare(surface);
        follow(surface, options_.surface.load);
    }

    bool is_loaded() const { return !options_.surface.load.empty(); }

    void follow(const Template& surface, const std::string& origin) const {
        require(defrec_tracker_set_template(tracker_.get(), surface.get()), ExitCode::kInput,
                "following the template of " + origin);
    }

    // A later frame's, from which a recording goes back to its first one.
    std::optional<FoundTemplate> search_template(ExitCode refusal) const {
        const TemplateSearchInput input{setup_.context, setup_.rig, desc_, options_.source,
                                        refusal};
        if (source_.is_live()) {
            if (options_.surface.frame)
                throw CliError(ExitCode::kUsage,
                               "--template-frame is for recordings: cameras do not go back.");
            return {};
        }
        if (options_.surface.frame) return capture_template_of(input, *options_.surface.frame);
        return find_template(input);
    }

    // Follows the frames from the template's back to the second one, whose results nobody sees: the
    // first frame is then the neighbour of one that was followed, and not a search.
    void go_back() const {
        SourceOptions options = options_.source;
        const std::int64_t first = options.range.first, end = found_->frame.index;
        if (end <= first || end - first > decisions::TemplateSearch::kLongestWayBack) return;
        options.range = {first, end + 1};
        FrameSource source(options);
        StereoFrame origin;
        if (!source.next(origin)) return;
        std::vector<StereoFrame> frames(static_cast<std::size_t>(end - first));
        for (StereoFrame& frame : frames)
            if (interrupt_requested() || !source.next(frame)) return;
        const double mirror = 2 * origin.timestamp_ms;
        for (auto frame = frames.rbegin(); frame != frames.rend(); ++frame) {
            // As far before the first frame as they are after it.
            frame->timestamp_ms = mirror - frame->timestamp_ms;
            const Job job = submit(tracker_, *frame);
            wait_for(job, frame->index);
        }
    }

    Projector projector() {
        return [this](const float* xyz, std::size_t count, float* uv) {
            setup_.projection.project(xyz, count, uv);
        };
    }

    std::unique_ptr<SessionPictures> open_pictures() {
        ReportMeta meta;
        meta.sequence = run_name(options_.source, source_.is_live(), folder_.path());
        meta.backend = setup_.device.id;
        meta.device = setup_.device.name;
        meta.version = defrec_version_string();
        meta.facts = {{"Calibration", calibration_name(options_.source, options_.calibration)},
                      {"Frame size",
                       std::to_string(source_.width()) + " x " + std::to_string(source_.height())},
                      {"Points", options_.points.empty() ? "a grid" : options_.points},
                      {"Run", folder_.run()}};
        if (beneath_.targets) meta.facts.emplace_back("Targets", options_.targets);
        if (beneath_.plan) meta.facts.emplace_back("Plan", options_.plan.file);
        return std::make_unique<SessionPictures>(
            PictureOptions{
                folder_.path(), source_.width(), source_.height(), source_.fps(), projector(),
                options_.recordings.overlay, options_.recordings.report,
                options_.recordings.overlay_details ? OverlayDetail::all : OverlayDetail::usual,
                source_.is_live() || options_.realtime},
            std::move(meta));
    }

    void open_view(std::uint16_t port) {
        auto projection = std::make_shared<RawProjection>(setup_.rig);
        pictures_->open_view(port,
                             {run_name(options_.source, source_.is_live(), folder_.path()),
                              setup_.device.name, defrec_version_string()},
                             [projection](const float* xyz, std::size_t count, float* uv) {
                                 projection->project(xyz, count, uv);
                             });
        pictures_->check_input(read_calibration(written_, options_.units),
                               rig_info(setup_.rig).camera);
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
                has_more = submit_next(has_pace ? &real_time : nullptr);
                continue;
            }
            if (pending_.empty()) break;
            take_result(pending_.front());
            pending_.pop_front();
        }
    }

    // false: there is no further frame. pace: null where frames are taken as they come.
    bool submit_next(RealTime* pace) {
        Pending next;
        const auto begin = TraceFile::Clock::now();
        if (!source_.next(next.frame)) return false;
        trace_host("read", next.frame, begin, TraceFile::Clock::now());
        if (pace != nullptr) pace->wait_for(next.frame.timestamp_ms);
        link_.take(timestamp_ns_of(next.frame));
        const auto begin_submit = TraceFile::Clock::now();
        next.job = submit(tracker_, next.frame, options_.deadline_ns);
        next.submitted = TraceFile::Clock::now();
        trace_host("submit", next.frame, begin_submit, next.submitted);
        pending_.push_back(std::move(next));
        return true;
    }

    void trace_host(const char* name, const StereoFrame& frame, TraceFile::Clock::time_point begin,
                    TraceFile::Clock::time_point end) {
        if (trace_) as_output([&] { trace_->add_host(name, frame.index, begin, end); });
    }

    void take_result(const Pending& pending) {
        const StereoFrame& frame = pending.frame;
        const auto begin = TraceFile::Clock::now();
        require(defrec_job_wait(pending.job.get(), UINT64_MAX), ExitCode::kInternal,
                "frame " + std::to_string(frame.index));
        const auto done = TraceFile::Clock::now();
        trace_host("wait", frame, begin, done);
        auto result = initialised<defrec_result>();
        require(defrec_job_result(pending.job.get(), &result), ExitCode::kInternal,
                "reading the result");
        if (trace_)
            as_output([&] { trace_->add_device(frame.index, result, pending.submitted, done); });
        if (result.template_epoch == 0) {
            if (template_.frame) give_up_template(frame.index);
        } else if (result.template_epoch != template_.epoch) {
            take_template(pending, result.template_epoch);
        }
        if (is_loaded() && !template_.has_grid && has_geometry(result)) {
            points_.begin_at(frame.index);
            template_.has_grid = true;
        }
        write_result(pending, result);
        trace_host("result", frame, begin, TraceFile::Clock::now());
        progress_.update(static_cast<std::int64_t>(frames_.rows().size()), source_.expected(),
                         *frames_.rows().back().state);
    }

    void write_result(const Pending& pending, const defrec_result& result) {
        const StereoFrame& frame = pending.frame;
        pictures_->obey_view(
            [&](const ViewCommand& command) { change_points(command, frame.index); });
        defrec_job job = has_geometry(result) ? pending.job.get() : nullptr;
        const std::vector<PointRow> points =
            points_.add_frame(frame.index, frame.timestamp_ms, job);
        std::vector<TargetRow> targets;
        if (beneath_.targets)
            targets = beneath_.targets->add_frame(frame.index, frame.timestamp_ms, job);
        PlanFrame plan;
        if (beneath_.plan) plan = beneath_.plan->add_frame(frame.index, frame.timestamp_ms, job);
        send(frame, result, points, targets, plan);
        const FrameRow row = frame_row(frame, result);
        frames_.add(row);
        if (has_geometry(result)) template_.trajectory.add(frame.timestamp_ms, result);
        say(notes_.add_frame(frame, result));
        pictures_->add_to_checks(frame, result, notes_.compression());
        if (options_.recordings.meshes && has_geometry(result)) write_mesh(frame.index, result);
        fill_record(row, result, points, targets, setup_.projection, record_);
        if (beneath_.plan) fill_plan(beneath_.plan->model(), plan, record_.plan);
        const auto drawing = TraceFile::Clock::now();
        const cv::Mat left = mat_of(frame.left);
        pictures_->add(left, record_);
        note_recordings();
        if (pictures_->has_view())
            pictures_->add_to_view(left, record_, view_points(points), points_.dropped_clicks());
        trace_host("overlay and report", frame, drawing, TraceFile::Clock::now());
    }

    // Nobody asked for the run to end where a recording of its live view does.
    void note_recordings() {
        for (std::string& note : pictures_->take_notes()) notes_.add(std::move(note));
    }

    // Receivers show it when it is shown, without the image that it is of.
    void send(const StereoFrame& frame, const defrec_result& result,
              const std::vector<PointRow>& points, const std::vector<TargetRow>& targets,
              const PlanFrame& plan) {
        if (!display_) return publish(frame, result, points, targets, plan);
        const FrameOutcome outcome{result.timestamp_ns, result.state, result.epoch};
        const std::vector<PointRow> points_then = display_->move(outcome, points);
        const std::vector<TargetRow> targets_then = display_->move(outcome, targets);
        publish(frame, result, points_then, targets_then, display_->move(outcome, plan));
    }

    void publish(const StereoFrame& frame, const defrec_result& result,
                 const std::vector<PointRow>& points, const std::vector<TargetRow>& targets,
                 const PlanFrame& plan) {
        if (!link_.is_open()) return;
        LinkFrame sent = link_frame(frame, result, template_.triangles, points, targets);
        if (options_.link_image)
            sent.image = {frame.left.pixels,   frame.left.width,  frame.left.height,
                          frame.left.channels, frame.left.stride, frame.pixels};
        if (plan.points != nullptr) sent.plan = link_plan(*beneath_.plan->model(), plan);
        link_.publish(std::move(sent));
    }

    void change_points(const ViewCommand& command, std::int64_t frame) {
        if (command.kind == ViewCommand::Kind::kFollowPoint)
            points_.follow(command.u, command.v, frame);
        else if (command.kind == ViewCommand::Kind::kRemovePoint)
            points_.remove(command.id);
        else
            points_.rename(command.id, command.name);
    }

    void say(const std::string& note) {
        if (note.empty() || options_.quiet) return;
        progress_.clear();
        print_notice(note);
    }

    void take_template(const Pending& pending, std::uint32_t epoch) {
        const Template surface = template_of(pending.job);
        if (desc_.body == DEFREC_BODY_ON && !source_.is_live()) await_body(surface);
        const defrec_template_info info = info_of(surface);
        const TemplateRecord record = template_record(info, setup_.projection);
        template_.epoch = epoch;
        template_.triangles = std::make_shared<const std::vector<std::uint32_t>>(record.triangles);
        if (template_.frame) return pictures_->change_template(record);
        const StereoFrame& origin = found_ ? found_->frame : pending.frame;
        template_.frame = origin.index;
        write_template(info, record);
        begin_points(surface);
        if (!template_.is_another) prepare_beneath(surface);
        pictures_->set_template(record, mat_of(origin.left));
        if (!is_loaded() && origin.index != options_.source.range.first)
            notes_.add_late_template({origin.index, found_.has_value(),
                                      options_.surface.frame.has_value(),
                                      beneath_.targets.has_value()});
    }

    void prepare_beneath(const Template& surface) {
        if (beneath_.targets) beneath_.targets->prepare(surface);
        if (beneath_.plan) beneath_.plan->prepare(surface);
    }

    // Points of a file are of the first image, the grid is of the template's.
    void begin_points(const Template& surface) {
        const std::int64_t first = options_.source.range.first;
        const bool is_grid = options_.points.empty();
        if (!is_loaded() && (is_grid || (!found_ && template_.frame == first)))
            points_.lift(surface, *template_.frame, desc_.grow != 0);
        else if (!is_grid)
            points_.begin_at(first);
    }

    // Points that were found on it have no place on the next one.
    void give_up_template(std::int64_t frame) {
        notes_.add_given_up(*template_.frame, frame);
        points_.forget_template();
        beneath_.forget_template();
        template_ = {};
        template_.is_another = true;
    }

    void write_template(const defrec_template_info& info, const TemplateRecord& record) const {
        std::vector<float> normals;
        for (std::uint64_t i = 0; i < info.vertex_count; ++i) {
            normals.insert(normals.end(), info.vertices[i].normal, info.vertices[i].normal + 3);
        }
        write_ply(folder_ / kTemplateFile,
                  {record.vertices.data(), normals.data(), nullptr, nullptr, info.vertex_count,
                   record.triangles.data(), info.triangle_count});
    }

    // The template as it was at the end, with what joined it.
    void finish_template() {
        if (!template_.frame) return;
        defrec_template handle = nullptr;
        require(defrec_tracker_get_template(tracker_.get(), &handle), ExitCode::kInternal,
                "reading the template");
        const Template surface(handle);
        const defrec_template_info info = info_of(surface);
        if (options_.grow) write_template(info, template_record(info, setup_.projection));
        if (options_.surface.save.empty()) return;
        require(defrec_template_save(surface.get(), options_.surface.save.c_str()),
                ExitCode::kOutput, "saving the template");
    }

    void write_mesh(std::int64_t frame, const defrec_result& result) {
        const std::vector<std::uint32_t>& triangles = *template_.triangles;
        write_ply(mesh_path(folder_ / kMeshFolder, frame),
                  {result.vertices, result.normals, result.vertex_status, result.expected_error_mm,
                   result.vertex_count, triangles.data(), triangles.size() / 3});
    }

    // Writes what there is, also after a failure; the first file that cannot be written is
    // reported. Returns the summary.
    nlohmann::ordered_json finish(double seconds, std::exception_ptr& failure) {
        notes_.add(source_.fault(), NoteSeverity::kError);
        if (const std::optional<BagFacts> bag = source_.bag_facts()) notes_.add(bag->remark());
        notes_.add(source_.disparity_remark());
        WrittenFiles files(folder_.path());
        // function: gives a file its name; it is listed where that name is not empty.
        const auto attempt = [&](const std::string& name, const std::function<void()>& function) {
            try {
                as_output(function);
                if (!name.empty()) files.add(name);
            } catch (const CliError&) {
                if (!failure) failure = std::current_exception();
            }
        };
        attempt("", [&] { points_.finish(); });
        notes_.conclude(points_, beneath_.targets ? &*beneath_.targets : nullptr,
                        beneath_.plan ? &*beneath_.plan : nullptr,
                        {template_.frame.has_value(), has_tracked(),
                         is_loaded() && !template_.has_grid ? options_.surface.load : ""});
        attempt(kPointsFile, [&] { points_.commit(); });
        if (beneath_.targets) attempt(kTargetsFile, [&] { beneath_.targets->commit(); });
        if (beneath_.plan) attempt(kPlanFile, [&] { beneath_.plan->commit(); });
        if (display_) attempt(kDisplayFile, [&] { display_->commit(); });
        attempt(template_.frame ? kTemplateFile : "", [&] { finish_template(); });
        attempt("", [&] {
            if (trace_) trace_->commit();
        });
        attempt(kFramesFile, [&] { write_frames(folder_ / kFramesFile, frames_); });
        attempt(kTrajectoryFile, [&] { template_.trajectory.write(folder_ / kTrajectoryFile); });
        pictures_->finish_recording();
        note_recordings();
        attempt("", [&] { notes_.add(pictures_->finish_overlay(), NoteSeverity::kRemark); });
        attempt("", [&] {
            SessionNotes notes = notes_;
            for (const std::string& warning : setup_.remarks.warnings())
                notes.add("The library's " + warning);
            pictures_->finish_report(origin_of_template(), notes);
        });
        for (const std::string& name : pictures_->written()) attempt(name, [] {});
        nlohmann::ordered_json summary = summarise_track(
            {options_, setup_.device, calibration_, rig_info(setup_.rig), frames_, points_,
             beneath_.targets ? &*beneath_.targets : nullptr,
             beneath_.plan ? &*beneath_.plan : nullptr, notes_.all(), notes_.is_one_view_twice(),
             setup_.remarks, is_loaded() ? std::nullopt : template_.frame, link_.facts(),
             source_.camera_counts(), source_.bag_facts(), source_.fps(), seconds});
        summary["run"] = folder_.run();
        summary["files"] = files.json();
        // It says that the run was finished, so the disk gets it last.
        synchronise_folder(folder_.path());
        attempt("", [&] {
            write_atomically(folder_ / kSummaryFile, json_text(summary, 2) + "\n");
            synchronise_folder(folder_.path());
        });
        return summary;
    }

    std::string origin_of_template() const {
        if (is_loaded()) return options_.surface.load;
        return template_.frame ? "frame " + std::to_string(*template_.frame) : "none";
    }

    // Any point or target has a position in any frame.
    bool has_tracked() const { return points_.rows().any_position() || beneath_.any_position(); }

    int report_end(const nlohmann::ordered_json& summary) const {
        if (!options_.quiet) {
            for (const std::string& note : notes_.left_to_say()) print_notice(note);
        } else if (!source_.fault().empty() || !has_tracked()) {
            print_notice(source_.fault().empty() ? kNothingTracked : source_.fault());
        }
        if (options_.json) {
            print(json_text(summary, 2) + "\n");
        } else if (!options_.quiet) {
            print(summary_text(summary, folder_.path()));
        }
        if (interrupt_requested()) return static_cast<int>(ExitCode::kInterrupted);
        if (!source_.fault().empty()) return static_cast<int>(ExitCode::kInput);
        return static_cast<int>(has_tracked() ? ExitCode::kOk : ExitCode::kNothingTracked);
    }

    TrackOptions options_;
    FrameSource source_;
    WrittenCalibration written_;
    StereoCalibration calibration_;  // the same, checked
    defrec_tracker_desc desc_;
    ProgressBar progress_;
    LinkOutput link_;
    Setup setup_;
    Followed followed_;  // until the followers have it
    const OutputFolder folder_;
    PointFollower points_;
    Beneath beneath_;
    std::optional<DisplayPrediction> display_;  // empty where no delay was given
    Tracker tracker_;
    std::optional<FoundTemplate> found_;  // that the tracker was given
    std::optional<TraceFile> trace_;
    std::unique_ptr<SessionPictures> pictures_;
    std::deque<Pending> pending_;
    SeenTemplate template_;
    FrameLog frames_;
    FrameRecord record_;
    SessionNotes notes_;
};

}  // namespace

int run_track(const TrackOptions& options) { return TrackSession(options).run(); }

}  // namespace defrec::cli
