// See live_view.hpp.
#include "sdk/live_view/live_view.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "sdk/io/json_text.hpp"
#include "sdk/live_view/doubts.hpp"
#include "sdk/live_view/page.hpp"
#include "sdk/live_view/steady_state.hpp"
#include "sdk/live_view/surface_depth.hpp"
#include "sdk/live_view/view_packet.hpp"
#include "sdk/live_view/view_server.hpp"
#include "sdk/report/light_plan.hpp"
#include "sdk/report/overlay.hpp"
#include "sdk/report/plan_outline.hpp"
#include "sdk/report/shown_state.hpp"
#include "sdk/report/target_mark.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

// Patience of a browser that waits for a frame; then it hears that there is none. A hidden page may
// have nothing else to tell the time by.
constexpr std::chrono::milliseconds kPatience{1200};
// After the end of a run, for pages that are between two requests and have not heard of it.
constexpr std::chrono::milliseconds kEndPatience{2000};
constexpr std::chrono::seconds kIsWatched{15};  // since a page last asked, also one that is slow
constexpr std::size_t kMaxPages = 64;
constexpr std::size_t kMaxHistory = 600;  // frames; of older ones a page learns changes alone
constexpr std::size_t kMaxChanges = 600;
constexpr std::size_t kMaxCommands = 64;  // not yet taken
constexpr int kMaxWidth = 960;            // of the pictures sent
constexpr int kJpegQuality = 80;
constexpr std::size_t kMaxName = 80;      // bytes of a point's name
constexpr std::size_t kMaxTargets = 500;  // shown, evenly chosen of more
constexpr std::size_t kMaxOutline = 160;  // points of an outline, evenly chosen of more

struct Shown {
    FrameRecord record;
    std::vector<ViewPoint> points;
    std::size_t dropped_clicks = 0;
    std::vector<TargetEstimate> targets;  // the record has none: the page draws them
    PlanEstimate plan;                    // likewise
    cv::Mat left;
    std::uint64_t surface = 0;  // number of the template that the record's vertices belong to
};

using Clock = std::chrono::steady_clock;

// The last frame that was "degraded".
struct Doubted {
    std::string reasons;
    ViewDoubts doubts;
    std::vector<ViewPoint> points;
};

struct Page {
    Clock::time_point asked;  // last
    bool knows_end = false;
};

double milliseconds_since(Clock::time_point time) {
    return std::chrono::duration<double, std::milli>(Clock::now() - time).count();
}

float hundredths(float value) { return std::round(value * 100) / 100; }

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

// [names, expected errors, count] of each kind; null where there is none.
Json doubts_json(const ViewDoubts& doubts) {
    if (doubts.is_empty()) return nullptr;
    const auto named = [](const ViewDoubts::Named& what) {
        return Json{what.names, what.errors_mm, what.count};
    };
    return {{"large", named(doubts.large)},
            {"targets", named(doubts.targets)},
            {"lost", named(doubts.lost)},
            {"never", named(doubts.never)},
            {"removed", doubts.removed}};
}

Json moment_json(const ViewMoment& moment) {
    return {moment.index,
            moment.timestamp_ms,
            moment.state,
            moment.reasons,
            number(moment.frame_ms),
            number(moment.observed_share),
            moment.faulty_views,
            moment.found,
            moment.is_held,
            moment.held_reasons,
            doubts_json(moment.doubts),
            moment.gap_ms};
}

Support support_of(double seen_share, const std::vector<ViewPoint>& points) {
    Support support{seen_share, {}, {}};
    for (const ViewPoint& point : points) {
        if (!point.is_chosen || point.status == VertexStatus::unknown) continue;
        const double error = point.expected_error_mm;
        support.least_error = std::min(support.least_error.value_or(error), error);
        support.largest_error = std::max(support.largest_error.value_or(error), error);
    }
    return support;
}

Json point_json(const ViewPoint& point) {
    Json json = {point.id, static_cast<int>(point.status), point.is_chosen, point.name};
    if (point.status == VertexStatus::unknown) return json;
    for (const double value :
         {point.u, point.v, point.x, point.y, point.z, point.expected_error_mm})
        json.push_back(number(value));
    return json;
}

Json target_json(const TargetEstimate& target, const Projector& projector) {
    Json json = {target.id, number(target.depth), static_cast<int>(target.status)};
    if (!target.name.empty()) json[0] = target.name;
    if (target.status == VertexStatus::unknown) return json;
    const TargetMark mark = target_mark(target, projector);
    for (const float value : {mark.u, mark.v, mark.radius, target.xyz[0], target.xyz[1],
                              target.xyz[2], expected_error(target)})
        json.push_back(number(value));
    return json;
}

Json targets_json(const std::vector<TargetEstimate>& targets, const Projector& projector) {
    Json json = Json::array();
    const std::size_t stride =
        std::max<std::size_t>(1, (targets.size() + kMaxTargets - 1) / kMaxTargets);
    for (std::size_t i = 0; i < targets.size(); i += stride)
        json.push_back(target_json(targets[i], projector));
    return json;
}

// [u, v, radius, kind] of each point: 0 a silhouette, 1 where the part goes on unknown, 2 where the
// image ends.
Json outline_json(const std::vector<OutlinePoint>& outline) {
    Json json = Json::array();
    const auto rounded = [](float value) { return std::round(double{value} * 10) / 10; };
    const std::size_t stride =
        std::max<std::size_t>(1, (outline.size() + kMaxOutline - 1) / kMaxOutline);
    for (std::size_t i = 0; i < outline.size(); i += stride) {
        const OutlinePoint& point = outline[i];
        json.push_back({number(rounded(point.u)), number(rounded(point.v)),
                        number(rounded(point.radius)),
                        point.is_cut       ? 2
                        : point.is_unknown ? 1
                                           : 0});
    }
    return json;
}

template <class Target>
std::size_t count_placed(const std::vector<Target>& targets) {
    return static_cast<std::size_t>(
        std::count_if(targets.begin(), targets.end(),
                      [](const Target& target) { return target.status != VertexStatus::unknown; }));
}

// Depth, the part's place that is nearest to the surface, and the surface's nearest to it.
Json depth_json(const std::optional<SurfaceDepth::Depth>& depth) {
    if (!depth) return nullptr;
    Json json = {number(double{hundredths(depth->mm)})};
    for (const cv::Vec3f& place : {depth->place, depth->above})
        for (const float value : place.val) json.push_back(number(double{hundredths(value)}));
    return json;
}

// The parts, [name, status, expected error, outlines, depth] each, and the targets.
Json plan_json(const PlanEstimate& plan, const SurfaceDepth& surface, const Projector& projector,
               cv::Size size) {
    Json parts = Json::array();
    for (std::size_t p = 0; p < plan.model->parts.size(); ++p) {
        const VertexStatus status =
            p < plan.parts.size() ? plan.parts[p].status : VertexStatus::unknown;
        parts.push_back({plan.model->parts[p].name, static_cast<int>(status), nullptr,
                         Json::array(), depth_json(surface.of(plan, plan.model->parts[p]))});
    }
    for (const PlanOutline& outline : plan_outlines(plan, projector, size.width, size.height)) {
        Json& part = parts[outline.part];
        part[2] = number(double{outline.expected_error_mm});
        for (const auto& contour : outline.contours) part[3].push_back(outline_json(contour));
    }
    std::vector<TargetEstimate> targets;
    for (const PointEstimate& target : plan.targets) {
        targets.push_back({target});
        if (target.status == VertexStatus::unknown) continue;
        if (const auto depth = surface.of(cv::Vec3f(target.xyz.data())))
            targets.back().depth = hundredths(depth->mm);
    }
    return {{"parts", parts},
            {"target_count", targets.size()},
            {"targets_placed", count_placed(targets)},
            {"targets", targets_json(targets, projector)}};
}

void add_jpeg(const char* name, const cv::Mat& picture, ViewPacket& packet) {
    cv::Mat smaller = picture;
    if (picture.cols > kMaxWidth) {
        const double scale = static_cast<double>(kMaxWidth) / picture.cols;
        cv::resize(picture, smaller, {}, scale, scale, cv::INTER_AREA);
    }
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", smaller, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
    packet.add(name, jpeg.data(), jpeg.size());
}

bool has(const Json& json, const char* name, bool (Json::*is_kind)() const noexcept) {
    return json.is_object() && json.contains(name) && (json[name].*is_kind)();
}

ViewAnswer plain(int status, std::string text) {
    return {status, std::move(text) + "\n", "text/plain"};
}

}  // namespace

struct LiveView::Impl {
    Impl(ViewFacts given, Projector given_projector)
        : facts(std::move(given)), projector(std::move(given_projector)), painter(projector) {}

    ViewAnswer page() const {
        std::string text;
        for (const std::string_view piece : live_page()) text += piece;
        return {200, std::move(text), "text/html; charset=utf-8"};
    }

    // Waits for a frame later than the one that the browser has.
    ViewAnswer frame(const ViewRequest& request) {
        std::shared_ptr<const Shown> shown;
        Json header;
        const Clock::time_point begin = Clock::now();
        {
            std::unique_lock lock(mutex);
            page_of(request.page).asked = begin;
            ++waiting;
            changed.wait_for(lock, kPatience, [&] {
                return has_ended || (newest && newest->record.index > request.after);
            });
            --waiting;
            page_of(request.page).asked = Clock::now();
            if (has_ended) {
                page_of(request.page).knows_end = true;
                told.notify_all();
                return plain(410, "the run has ended");
            }
            if (!newest || newest->record.index <= request.after)
                return {204, "", "application/octet-stream"};
            shown = newest;
            header = describe(*shown, request.after);
            header["waited_ms"] = milliseconds_since(begin);
        }
        ViewAnswer answer{200, body(*shown, std::move(header), request.has_overlay),
                          "application/octet-stream"};
        const std::lock_guard lock(mutex);  // of the reference that is given back
        shown.reset();
        return answer;
    }

    // mutex is held.
    Json describe(const Shown& shown, std::int64_t after) const {
        Json header = {{"frame", shown.record.index},
                       {"timestamp_ms", shown.record.timestamp_ms},
                       {"sequence", facts.sequence},
                       {"device", facts.device},
                       {"version", facts.version},
                       {"width", shown.left.cols},
                       {"height", shown.left.rows},
                       {"surface", shown.surface},
                       {"dropped_clicks", shown.dropped_clicks},
                       {"target_count", shown.targets.size()},
                       {"targets_placed", count_placed(shown.targets)},
                       {"is_given_up", shown_state.is_given_up()},
                       {"residual_mm", number(shown.record.mean_residual_mm)},
                       {"age_ms", milliseconds_since(newest_at)},
                       {"outage_ms", outage_limit.ms()},
                       {"recording", recording},
                       {"message", {{"number", messages}, {"text", message}}},
                       {"has_checks", !checks.empty()}};
        header["points"] = Json::array();
        header["never_placed"] = Json::array();
        for (const ViewPoint& point : shown.points) {
            header["points"].push_back(point_json(point));
            if (point.is_chosen && placed.count(point.id) == 0)
                header["never_placed"].push_back(point.id);
        }
        header["stages"] = Json::array();
        for (const auto& [name, ms] : shown.record.stage_ms)
            header["stages"].push_back({name, number(ms)});
        header["moments"] = Json::array();
        for (const auto* moments : {&changes, &history})
            for (const ViewMoment& moment : *moments)
                if (moment.index > after) header["moments"].push_back(moment_json(moment));
        return header;
    }

    // mutex is held. The moment of a frame that has come.
    ViewMoment moment_of(const FrameRecord& frame, const std::vector<ViewPoint>& points) {
        for (const ViewPoint& point : points)
            if (point.is_chosen && point.status != VertexStatus::unknown) placed.insert(point.id);
        const Support support = support_of(frame.observed_share, points);
        std::string said =
            shown_state.take(frame.state, frame.reasons, frame.timestamp_ms, support);
        const bool is_unseen = frame.observed_share < ShownState::kLeastSeen;
        ViewDoubts doubts;  // where nothing is seen no point has a place, which says enough
        if (!is_unseen) doubts = doubts_of(points, frame.targets, placed);
        const bool is_good = said == "tracking" || said == "found" || said == "relocalised";
        if (is_good && !doubts.is_empty()) said = "degraded";
        ViewMoment moment{frame.index,
                          frame.timestamp_ms,
                          {},
                          reasons_of(said, frame.reasons, support),
                          frame.frame_ms,
                          frame.observed_share,
                          frame.faulty_views,
                          shown_state.found()};
        moment.state = steady_state.take(said, moment.found, frame.timestamp_ms, is_unseen);
        moment.gap_ms = steady_state.gap_ms();
        if (moment.found.empty() && steady_state.is_resumed()) moment.found = "resumed";
        if (said == "degraded") last_doubt = {moment.reasons, doubts, points};
        moment.is_held = steady_state.is_held();
        moment.doubts = std::move(doubts);
        if (!moment.is_held) return moment;
        moment.held_reasons = last_doubt.reasons;
        moment.doubts = doubts_that_stay(last_doubt.doubts, last_doubt.points, points, placed);
        return moment;
    }

    // mutex is held.
    void remember(ViewMoment moment) {
        if (newest_at != Clock::time_point()) outage_limit.add(milliseconds_since(newest_at));
        newest_at = Clock::now();
        history.push_back(std::move(moment));
        if (history.size() <= kMaxHistory) return;
        ViewMoment& old = history.front();
        if (changes.empty() || changes.back().state != old.state ||
            changes.back().reasons != old.reasons || old.gap_ms > 0)
            changes.push_back(std::move(old));
        if (changes.size() > kMaxChanges) changes.pop_front();
        history.pop_front();
    }

    // mutex is held.
    Page& page_of(const std::string& id) {
        const auto found = pages.find(id);
        if (found == pages.end() && pages.size() == kMaxPages)
            pages.erase(std::min_element(pages.begin(), pages.end(), [](auto& a, auto& b) {
                return a.second.asked < b.second.asked;
            }));
        return found == pages.end() ? pages[id] : found->second;
    }

    // mutex is held.
    bool every_page_knows() const {
        return std::all_of(pages.begin(), pages.end(), [](const auto& item) {
            return item.second.knows_end || Clock::now() - item.second.asked > kIsWatched;
        });
    }

    std::string body(const Shown& shown, Json header, bool has_overlay) {
        const FrameRecord& record = shown.record;
        ViewPacket packet;
        cv::Mat overlay;
        std::vector<float> uv(record.vertices.size() / 3 * 2);
        {
            const std::lock_guard lock(painting);
            choose_surface(shown.surface);
            if (has_overlay) {
                shown.left.copyTo(overlay);
                if (overlay.channels() == 1) cv::cvtColor(overlay, overlay, cv::COLOR_GRAY2BGR);
                painter.draw_without_text(overlay, record);
            }
            projector(record.vertices.data(), record.vertices.size() / 3, uv.data());
            header["targets"] = targets_json(shown.targets, projector);
            header["plan"] = nullptr;
            if (shown.plan.model) add_plan(shown, header, packet);
        }
        add_jpeg("left", shown.left, packet);
        if (has_overlay) add_jpeg("overlay", overlay, packet);
        packet.add("xyz", record.vertices.data(), record.vertices.size());
        packet.add("uv", uv.data(), uv.size());
        packet.add("error", record.expected_error_mm.data(), record.expected_error_mm.size());
        packet.add("status", record.vertex_status.data(), record.vertex_status.size());
        return packet.body(json_text(header));
    }

    // painting is held. The model in 3D is left out of a lost frame.
    void add_plan(const Shown& shown, Json& header, ViewPacket& packet) {
        const PlanEstimate& plan = shown.plan;
        const std::vector<float>& vertices = shown.record.vertices;
        const bool is_meshed =
            painted_surface == shown.surface && vertices.size() == painted.vertices.size();
        const SurfaceDepth beneath(
            is_meshed ? std::span<const float>(vertices) : std::span<const float>(),
            is_meshed ? std::span<const std::uint32_t>(painted.triangles)
                      : std::span<const std::uint32_t>());
        header["plan"] = plan_json(plan, beneath, projector, shown.left.size());
        if (light.is_empty() && !plan.vertices.empty()) light = LightPlan(plan);
        const std::vector<float> xyz = light.positions(plan);
        const std::vector<float> error = light.expected_error_mm(plan);
        packet.add("plan_xyz", xyz.data(), xyz.size());
        packet.add("plan_error", error.data(), error.size());
    }

    // painting is held.
    void choose_surface(std::uint64_t wanted) {
        if (painted_surface == wanted) return;
        const std::lock_guard lock(mutex);
        if (wanted != surface) return;  // a later frame's; its geometry is left out by its size
        painted = reference;
        painter.set_template(painted);
        painted_surface = wanted;
    }

    // The triangles of the surface, and of the plan's model in 3D: [first, count] of each part's.
    ViewAnswer triangles() {
        ViewPacket packet;
        Json header{{"plan_parts", Json::array()}};
        const std::scoped_lock lock(painting, mutex);
        header["surface"] = surface;
        packet.add("triangles", reference.triangles.data(), reference.triangles.size());
        for (const PlanModel::Part& part : light.parts())
            header["plan_parts"].push_back({part.first_triangle, part.triangle_count});
        packet.add("plan_triangles", light.triangles().data(), light.triangles().size());
        return {200, packet.body(json_text(header)), "application/octet-stream"};
    }

    ViewAnswer look_at_checks() const {
        const std::lock_guard lock(mutex);
        if (checks.empty()) return {204, "", "application/json"};
        return {200, checks, "application/json"};
    }

    // {u, v} follows a point, {id, name} names one, {id, removed: true} ends one.
    ViewAnswer change_points(const ViewRequest& request) {
        const Json json = Json::parse(request.body, nullptr, false);
        if (has(json, "id", &Json::is_number_integer)) return change_point(json);
        if (!has(json, "u", &Json::is_number) || !has(json, "v", &Json::is_number))
            return plain(400, "an object with the numbers u and v, or with an id, is expected");
        const ViewCommand command{ViewCommand::Kind::kFollowPoint, json["u"].get<double>(),
                                  json["v"].get<double>()};
        const std::lock_guard lock(mutex);
        if (!(command.u >= -0.5 && command.u <= left_size.width - 0.5 && command.v >= -0.5 &&
              command.v <= left_size.height - 0.5))
            return plain(400, "the pixel lies outside the left image");
        return take(command);
    }

    ViewAnswer change_point(const Json& json) {
        ViewCommand command;
        command.id = json["id"].get<std::int64_t>();
        if (has(json, "removed", &Json::is_boolean) && json["removed"].get<bool>()) {
            command.kind = ViewCommand::Kind::kRemovePoint;
        } else if (has(json, "name", &Json::is_string) &&
                   json["name"].get_ref<const std::string&>().size() <= kMaxName) {
            command.kind = ViewCommand::Kind::kNamePoint;
            command.name = json["name"];
        } else {
            return plain(400, "beside the id, removed: true or a name of at most " +
                                  std::to_string(kMaxName) + " bytes is expected");
        }
        const std::lock_guard lock(mutex);
        return take(command);
    }

    ViewAnswer record(const ViewRequest& request) {
        const Json json = Json::parse(request.body, nullptr, false);
        if (!has(json, "on", &Json::is_boolean))
            return plain(400, "an object with the boolean on is expected");
        ViewCommand command{ViewCommand::Kind::kRecord};
        command.is_on = json["on"].get<bool>();
        const std::lock_guard lock(mutex);
        return take(command);
    }

    // mutex is held.
    ViewAnswer take(const ViewCommand& command) {
        if (commands.size() == kMaxCommands) return plain(503, "too many requests wait");
        commands.push_back(command);
        return plain(202, "taken");
    }

    const ViewFacts facts;

    std::mutex painting;  // of what follows
    Projector projector;
    OverlayPainter painter;
    TemplateRecord painted;  // the painter's
    std::uint64_t painted_surface = 0;
    LightPlan light;  // of the first frame in which the plan has a place

    mutable std::mutex mutex;  // of what follows
    std::condition_variable changed, told;
    std::shared_ptr<Shown> newest;            // null where nobody waited for the last frame
    std::shared_ptr<Shown> spare;             // to be filled again once nobody reads it
    std::deque<ViewMoment> changes, history;  // changes: before the history
    Clock::time_point newest_at;              // of the history
    OutageLimit outage_limit;                 // of frames as they come here
    cv::Size left_size;                       // of the last frame
    ShownState shown_state;
    SteadyState steady_state;
    Doubted last_doubt;
    std::set<std::int64_t> placed;      // ids of points that users chose, which had a place once
    std::map<std::string, Page> pages;  // by their own ids
    TemplateRecord reference;
    std::uint64_t surface = 0;  // its number, from 1
    std::vector<ViewCommand> commands;
    std::string recording;
    std::string message;         // the last one
    std::uint64_t messages = 0;  // its number, from 1
    std::string checks;          // empty: not yet
    int waiting = 0;             // browsers
    bool has_ended = false;

    std::optional<ViewServer> server;  // ends first
};

LiveView::LiveView(std::uint16_t port, ViewFacts facts, Projector projector)
    : impl_(std::make_unique<Impl>(std::move(facts), std::move(projector))) {
    Impl& impl = *impl_;
    impl.server.emplace(
        port, ViewServer::Handlers{
                  [&impl](const ViewRequest&) { return impl.page(); },
                  [&impl](const ViewRequest& request) { return impl.frame(request); },
                  [&impl](const ViewRequest&) { return impl.triangles(); },
                  [&impl](const ViewRequest&) { return impl.look_at_checks(); },
                  [&impl](const ViewRequest& request) { return impl.change_points(request); },
                  [&impl](const ViewRequest& request) { return impl.record(request); }});
}

LiveView::~LiveView() {
    end();
    wait_for_pages(kEndPatience);
}

void LiveView::wait_for_pages(std::chrono::milliseconds most) {
    std::unique_lock lock(impl_->mutex);
    impl_->told.wait_for(lock, most, [this] { return impl_->every_page_knows(); });
}

void LiveView::end() {
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->has_ended = true;
    }
    impl_->changed.notify_all();
}

const std::string& LiveView::url() const { return impl_->server->url(); }

void LiveView::set_template(const TemplateRecord& reference) {
    const std::lock_guard lock(impl_->mutex);
    impl_->reference = reference;
    ++impl_->surface;
}

void LiveView::add(const cv::Mat& left, const FrameRecord& frame, std::vector<ViewPoint> points,
                   std::size_t dropped_clicks) {
    std::shared_ptr<Shown> shown;
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->remember(impl_->moment_of(frame, points));
        impl_->left_size = left.size();
        if (impl_->waiting == 0) {
            // A page that comes now would take the frame before for that of now.
            if (impl_->newest) impl_->spare = std::move(impl_->newest);
            return;
        }
        if (impl_->spare.use_count() == 1) shown = std::move(impl_->spare);
    }
    if (!shown) shown = std::make_shared<Shown>();
    shown->record = frame;
    shown->record.points.clear();  // the page draws them
    shown->targets.clear();
    shown->targets.swap(shown->record.targets);
    shown->plan = std::exchange(shown->record.plan, {});
    shown->points = std::move(points);
    shown->dropped_clicks = dropped_clicks;
    left.copyTo(shown->left);
    {
        const std::lock_guard lock(impl_->mutex);
        shown->surface = impl_->surface;
        impl_->spare = std::exchange(impl_->newest, std::move(shown));
    }
    impl_->changed.notify_all();
}

void LiveView::set_recording(const std::string& name) {
    const std::lock_guard lock(impl_->mutex);
    impl_->recording = name;
}

void LiveView::tell(const std::string& message) {
    const std::lock_guard lock(impl_->mutex);
    impl_->message = message;
    ++impl_->messages;
}

void LiveView::set_checks(std::string checks) {
    const std::lock_guard lock(impl_->mutex);
    impl_->checks = std::move(checks);
}

int LiveView::waiting() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->waiting;
}

std::vector<ViewCommand> LiveView::take_commands() {
    const std::lock_guard lock(impl_->mutex);
    return std::exchange(impl_->commands, {});
}

}  // namespace defrec::cli
