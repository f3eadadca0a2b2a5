// summary.json: a tracked sequence in numbers.
#include "sdk/session/track_summary.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core/version.hpp>

#include "sdk/contract/enumerations.hpp"
#include "sdk/input/bag_calibration.hpp"
#include "sdk/input/camera_name.hpp"
#include "sdk/io/counted.hpp"
#include "sdk/io/process_memory.hpp"
#include "sdk/io/statistics.hpp"
#include "sdk/io/text.hpp"
#include "sdk/report/doubtful_frames.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

// Where both views come from.
Json views_json(const SourceOptions& source, const std::optional<BagFacts>& bag) {
    if (bag && source.bag.has_stereo_images)
        return {{"bag", source.bag.path},
                {"stereo_topic", bag->left_topic},
                {"layout", layout_name(source.layout)}};
    if (bag)
        return {{"bag", source.bag.path},
                {"left_topic", bag->left_topic},
                {"right_topic", bag->right_topic}};
    if (source.stereo.empty())
        return {{"left", shown_source(source.left)}, {"right", shown_source(source.right)}};
    return {{"stereo", shown_source(source.stereo)}, {"layout", layout_name(source.layout)}};
}

Json input_json(const TrackFacts& facts) {
    const TrackOptions& options = facts.options;
    Json json = views_json(options.source, facts.bag);
    json["times"] = options.source.times.empty() ? Json(nullptr) : Json(options.source.times);
    json["calibration"] = calibration_name(options.source, options.calibration);
    json["points"] = options.points.empty() ? Json(nullptr) : Json(options.points);
    json["targets"] = options.targets.empty() ? Json(nullptr) : Json(options.targets);
    json["disparity"] =
        options.source.disparity.empty() ? Json(nullptr) : Json(options.source.disparity);
    json["plan"] = options.plan.file.empty() ? Json(nullptr) : Json(options.plan.file);
    json["config"] = options.config.empty() ? Json(nullptr) : Json(options.config);
    json["seed"] = options.seed;
    json["fps"] = facts.fps;
    return json;
}

// As they were typed, also those that were not given: `defrec track --like` gives them again.
Json options_json(const std::vector<RecordedOption>& options) {
    Json json = Json::object();
    for (const RecordedOption& option : options) {
        if (option.is_flag)
            json[option.name] = option.value.has_value();
        else
            json[option.name] = option.value ? Json(*option.value) : Json(nullptr);
    }
    return json;
}

Json versions_json() {
    const std::uint32_t api = defrec_version();
    return {{"defrec", defrec_version_string()},
            {"api", std::to_string(api / 1000) + "." + std::to_string(api % 1000)},
            {"opencv", CV_VERSION}};
}

Json camera_json(const TrackFacts& facts) {
    const defrec_camera& camera = facts.rig.camera;
    return {{"width", facts.calibration.width},
            {"height", facts.calibration.height},
            {"resampled", facts.rig.identity == 0},
            {"fx", camera.fx},
            {"fy", camera.fy},
            {"cx", camera.cx},
            {"cy", camera.cy},
            {"disparity_offset_px", camera.disparity_offset_px},
            {"baseline_mm", camera.baseline_mm}};
}

Json states_json(const std::vector<FrameLog::Row>& rows) {
    Json json = Json::object();
    for (const EnumeratorName& state : kStateNames) {
        json[state.name] = std::count_if(rows.begin(), rows.end(), [&](const FrameLog::Row& row) {
            return *row.state == state.name;
        });
    }
    return json;
}

// Number of frames of each reason that occurs.
Json reasons_json(const std::vector<FrameLog::Row>& rows) {
    Json json = Json::object();
    for (const FrameLog::Row& row : rows) {
        if (row.reasons->empty()) continue;
        for (const std::string_view reason : split(*row.reasons, '|')) {
            Json& frames = json[std::string(reason)];
            frames = frames.is_null() ? 1 : frames.get<int>() + 1;
        }
    }
    return json;
}

// The run has said that one view given twice has no depth.
Json doubtful_json(const std::vector<FrameLog::Row>& rows, bool is_one_view_twice) {
    DoubtfulFramesList list;
    bool was_followed = false;
    for (const FrameLog::Row& row : rows) {
        const bool is_lost = *row.state == "lost";
        was_followed = was_followed || (!is_lost && *row.state != "initialising");
        list.add(row.frame, is_lost && !was_followed ? "unfound" : *row.state, *row.reasons,
                 *row.faulty_views);
    }
    Json json = Json::array();
    for (const DoubtfulFrames& each : list.sorted()) {
        if (is_one_view_twice && each.reason == "no-depth") continue;
        json.push_back({{"state", each.state},
                        {"reason", each.reason.empty() ? Json(nullptr) : Json(each.reason)},
                        {"first", each.first},
                        {"last", each.last},
                        {"frames", each.count},
                        {"text", each.where() + " " + each.state + ": " + each.why}});
    }
    return json;
}

// As measured up to the last frame; null where never measured.
Json rig_estimate_json(const std::vector<FrameLog::Row>& rows) {
    const auto last = std::find_if(rows.rbegin(), rows.rend(),
                                   [](const FrameLog::Row& row) { return row.rig_matches > 0; });
    if (last == rows.rend()) return nullptr;
    return {{"vertical_offset_px", last->vertical_offset_px},
            {"roll_deg", last->roll_deg},
            {"focal_ratio", last->focal_ratio},
            {"matches", last->rig_matches}};
}

void add_shares(const StatusCounts& rows, Json& json) {
    for (const PointStatus status :
         {PointStatus::kTracked, PointStatus::kExtrapolated, PointStatus::kLost})
        json[std::string(name_of(status)) + "_share"] = rows.share(status);
}

Json points_json(const PointFollower& points) {
    Json json{{"count", points.count()},
              {"without_surface", points.points_without_surface().size()},
              {"of_lost_frames", points.points_of_lost_frames()},
              {"never_reached", points.points_never_reached()}};
    add_shares(points.rows(), json);
    return json;
}

Json targets_json(const TargetFollower* targets) {
    if (targets == nullptr) return nullptr;
    Json json{{"count", targets->count()}};
    add_shares(targets->rows(), json);
    return json;
}

Json plan_json(const PlanFollower* plan) {
    if (plan == nullptr) return nullptr;
    Json targets{{"count", plan->target_count()}}, parts{{"count", 0}};
    add_shares(plan->target_rows(), targets);
    Json names = Json::array();
    if (plan->model())
        for (const PlanModel::Part& part : plan->model()->parts) names.push_back(part.name);
    parts["count"] = names.size();
    parts["names"] = std::move(names);
    add_shares(plan->part_rows(), parts);
    parts["partly_known_share"] = plan->partly_known().share();
    parts["known_share"] = plan->partly_known().known_share();
    return {{"targets", targets}, {"parts", parts}, {"meshes", plan->mesh_count()}};
}

Json link_json(const TrackFacts& facts) {
    if (!facts.link) return nullptr;
    return {{"endpoint", to_string(facts.link->endpoint)},
            {"receivers", facts.link->counts.receivers},
            {"frames_sent", facts.link->counts.sent},
            {"frames_dropped", facts.link->counts.dropped}};
}

Json cameras_json(const TrackFacts& facts) {
    if (!facts.cameras) return nullptr;
    const PairCounts& pairs = facts.cameras->pairs;
    const auto count = static_cast<double>(std::max<std::int64_t>(1, pairs.pairs));
    return {{"frames_received", pairs.pairs},
            {"frames_dropped", pairs.dropped},
            {"images_unpaired", pairs.unpaired},
            {"mean_difference_ms", pairs.difference_sum_ms / count},
            {"reconnections", facts.cameras->reconnections},
            {"longest_gap_ms", facts.cameras->longest_gap_ms}};
}

Json bag_json(const TrackFacts& facts) {
    if (!facts.bag) return nullptr;
    const PairCounts& pairs = facts.bag->pairs;
    const auto count = static_cast<double>(std::max<std::int64_t>(1, pairs.pairs));
    return {{"images_unpaired", pairs.unpaired},
            {"mean_difference_ms", pairs.difference_sum_ms / count}};
}

double mean_of(const std::vector<FrameLog::Row>& rows, double FrameNumbers::*member) {
    double sum = 0;
    std::size_t count = 0;
    for (const FrameLog::Row& row : rows) {
        if (!std::isfinite(row.*member)) continue;
        sum += row.*member;
        ++count;
    }
    return count > 0 ? sum / static_cast<double>(count) : 0;
}

std::string percent(const Json& share) { return format_fixed(100 * share.get<double>(), 1) + " %"; }

std::string shares_text(const Json& json, const char* one) {
    return counted(json["count"].get<std::size_t>(), one) + ": " + percent(json["tracked_share"]) +
           " tracked, " + percent(json["extrapolated_share"]) + " extrapolated, " +
           percent(json["lost_share"]) + " lost\n";
}

// Beneath the surface to be extrapolated is the rule. A part that is partly known has no middle,
// and its rows are lost; pictures and meshes show what is known.
std::string placed_text(const Json& json, const char* one, const char* several) {
    const double placed =
        json["tracked_share"].get<double>() + json["extrapolated_share"].get<double>();
    const double partly = json.value("partly_known_share", 0.0);
    std::string text = counted(json["count"].get<std::size_t>(), one, several) + ": " +
                       percent(placed) + " placed, ";
    if (partly > 0)
        text += percent(partly) + " partly known (" + percent(json["known_share"]) +
                " of the vertices), ";
    return text + percent(json["lost_share"].get<double>() - partly) + " lost\n";
}

std::string doubtful_text(const Json& doubtful) {
    std::string text;
    std::size_t frames = 0;
    for (std::size_t i = 0; i < doubtful.size(); ++i)
        if (i < kDoubtfulFramesSaid)
            text += "  " + doubtful[i]["text"].get<std::string>() + "\n";
        else
            frames += doubtful[i]["frames"].get<std::size_t>();
    if (frames > 0)
        text += "  " + counted(frames, "further frame") + (frames == 1 ? " is" : " are") +
                " in doubt: see reasons in frames.csv\n";
    return text;
}

}  // namespace

const char* layout_name(Layout layout) {
    return layout == Layout::kSideBySide ? "side-by-side" : "top-bottom";
}

Json stage_statistics(const FrameLog& frames) {
    Json json = Json::object();
    std::vector<double> values(frames.rows().size());
    const auto add = [&](const std::string& name) {
        json[name] = {{"median_ms", nearest_rank(values, 0.5)},
                      {"p99_ms", nearest_rank(values, 0.99)}};
    };
    for (const FrameLog::Stage& stage : frames.stages()) {
        std::copy(stage.ms.begin(), stage.ms.end(), values.begin());
        add(stage.name);
    }
    std::transform(frames.rows().begin(), frames.rows().end(), values.begin(),
                   [](const FrameLog::Row& row) { return row.frame_ms; });
    add("frame");
    return json;
}

Json summarise_track(const TrackFacts& facts) {
    const std::vector<FrameLog::Row>& rows = facts.frames.rows();
    Json json;
    json["defrec"] = defrec_version_string();
    json["versions"] = versions_json();
    json["folder"] = std::filesystem::current_path().string();
    json["options"] = options_json(facts.options.recorded);
    json["input"] = input_json(facts);
    json["device"] = {{"id", facts.device.id}, {"name", facts.device.name}};
    json["rectified_camera"] = camera_json(facts);
    json["frames"] = rows.size();
    json["first_frame"] = rows.empty() ? Json(nullptr) : Json(rows.front().frame);
    json["last_frame"] = rows.empty() ? Json(nullptr) : Json(rows.back().frame);
    json["template_frame"] = facts.template_frame ? Json(*facts.template_frame) : Json(nullptr);
    const std::string& loaded = facts.options.surface.load;
    json["template_file"] = loaded.empty() ? Json(nullptr) : Json(loaded);
    json["states"] = states_json(rows);
    json["reasons"] = reasons_json(rows);
    json["doubtful"] = doubtful_json(rows, facts.is_one_view_twice);
    json["rig_estimate"] = rig_estimate_json(rows);
    json["points"] = points_json(facts.points);
    json["targets"] = targets_json(facts.targets);
    json["plan"] = plan_json(facts.plan);
    json["mean_observed_share"] = mean_of(rows, &FrameLog::Row::observed_share);
    json["mean_residual_mm"] = mean_of(rows, &FrameLog::Row::mean_residual_mm);
    json["stages"] = stage_statistics(facts.frames);
    json["live_link"] = link_json(facts);
    json["cameras"] = cameras_json(facts);
    json["bag"] = bag_json(facts);
    json["seconds"] = facts.seconds;
    json["peak_memory_mb"] = peak_megabytes();
    json["library"] = facts.library.all();
    json["warnings"] = facts.library.warnings();
    for (const std::string& warning : facts.library.warnings_of_opening())
        json["warnings"].push_back(warning);
    json["notes"] = facts.notes;
    return json;
}

std::string summary_text(const Json& summary, const std::filesystem::path& folder) {
    std::string text = counted(summary["frames"].get<std::size_t>(), "frame") + " on " +
                       summary["device"]["id"].get<std::string>() + ":";
    for (const auto& [state, count] : summary["states"].items()) {
        if (count.get<std::int64_t>() == 0) continue;
        text.append(" ")
            .append(std::to_string(count.get<std::int64_t>()))
            .append(" ")
            .append(state)
            .append(",");
    }
    text.back() = '\n';
    text += doubtful_text(summary["doubtful"]);
    if (const Json& file = summary["template_file"]; !file.is_null())
        text += "template of " + file.get<std::string>() + "\n";
    else if (const Json& frame = summary["template_frame"]; !frame.is_null())
        text += "template of frame " + std::to_string(frame.get<std::int64_t>()) + "\n";
    text += shares_text(summary["points"], "point");
    if (!summary["targets"].is_null()) text += shares_text(summary["targets"], "target");
    if (const Json& plan = summary["plan"]; !plan.is_null())
        text += placed_text(plan["targets"], "target of the plan", "targets of the plan") +
                placed_text(plan["parts"], "part of the plan", "parts of the plan");
    const Json& frame = summary["stages"]["frame"];
    text += "a frame takes " + format_fixed(frame["median_ms"].get<double>(), 1) +
            " ms (median), " + format_fixed(frame["p99_ms"].get<double>(), 1) +
            " ms (99th percentile)\n";
    return text + "report: " + (folder / "report.html").string() + "\n";
}

}  // namespace defrec::cli
