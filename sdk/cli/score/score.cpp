// How far tracked points are from the truth.
#include "sdk/cli/score/score.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <unordered_map>

#include "sdk/cli/io/csv.hpp"
#include "sdk/cli/io/text.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Key {
    std::int64_t frame, id;
    bool operator==(const Key&) const = default;
};

struct KeyHash {
    std::size_t operator()(const Key& key) const {
        return static_cast<std::size_t>(static_cast<std::uint64_t>(key.frame) *
                                            0x9E3779B97F4A7C15u ^
                                        static_cast<std::uint64_t>(key.id) * 0xC2B2AE3D27D4EB4Fu);
    }
};

struct Tracked {
    bool has_position = false;
    std::array<double, 3> xyz{};
};

using TrackedPoints = std::unordered_map<Key, Tracked, KeyHash>;

TrackedPoints read_tracked(const std::filesystem::path& path) {
    CsvReader csv(path, {"frame", "id", "x", "y", "z", "status"});
    TrackedPoints points;
    while (csv.next()) {
        Tracked tracked;
        tracked.has_position = csv.field(5) != "lost" && !csv.is_empty(2);
        if (tracked.has_position) tracked.xyz = {csv.number(2), csv.number(3), csv.number(4)};
        const Key key{csv.integer(0), csv.integer(1)};
        if (!points.emplace(key, tracked).second) {
            csv.fail("frame " + std::to_string(key.frame) + ", id " + std::to_string(key.id) +
                     " stands here again.");
        }
    }
    return points;
}

struct States {
    std::unordered_map<std::int64_t, std::string> of_frame;
    std::vector<std::string> order;
};

States read_states(const std::filesystem::path& path) {
    States states;
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return states;
    CsvReader csv(path, {"frame", "state"});
    while (csv.next()) {
        const std::string state(csv.field(1));
        states.of_frame[csv.integer(0)] = state;
        if (std::find(states.order.begin(), states.order.end(), state) == states.order.end()) {
            states.order.push_back(state);
        }
    }
    return states;
}

// Collects the rows of one group while the truth is read.
struct Group {
    std::set<std::int64_t> frames;
    std::vector<double> visible, hidden;
    std::size_t visible_points = 0, lost_visible = 0;

    void add(std::int64_t frame, bool is_visible, std::optional<double> error) {
        frames.insert(frame);
        if (is_visible) {
            ++visible_points;
            lost_visible += error ? 0 : 1;
        }
        if (error) (is_visible ? visible : hidden).push_back(*error);
    }

    ScoreGroup finish(const std::string& name) {
        return {name,
                frames.size(),
                summarise(std::move(visible)),
                summarise(std::move(hidden)),
                visible_points,
                lost_visible};
    }
};

std::string padded(const std::string& text, std::size_t width, bool to_the_right = true) {
    const std::string blanks(text.size() < width ? width - text.size() : 0, ' ');
    return to_the_right ? blanks + text : text + blanks;
}

std::string table_line(const std::string& name, const ErrorSummary& summary,
                       const std::string& lost) {
    std::string line = padded(name, 22, false) + padded(std::to_string(summary.count), 9);
    for (const double value :
         {summary.median, summary.mean, summary.rmse, summary.p95, summary.max}) {
        line += padded(summary.count > 0 ? format_fixed(value, 3) : "-", 9);
    }
    return line + padded(lost, 9) + "\n";
}

Json errors_json(const ErrorSummary& summary) {
    Json json;
    json["count"] = summary.count;
    const auto number = [&](double value) {
        return summary.count > 0 ? Json(value) : Json(nullptr);
    };
    json["median_mm"] = number(summary.median);
    json["mean_mm"] = number(summary.mean);
    json["rmse_mm"] = number(summary.rmse);
    json["p95_mm"] = number(summary.p95);
    json["max_mm"] = number(summary.max);
    return json;
}

Json group_json(const ScoreGroup& group) {
    Json json;
    json["frames"] = group.frames;
    json["visible"] = errors_json(group.visible);
    json["hidden"] = errors_json(group.hidden);
    json["visible_points"] = group.visible_points;
    json["lost_visible"] = group.lost_visible;
    json["lost_share"] = group.lost_share();
    return json;
}

}  // namespace

ErrorSummary summarise(std::vector<double> errors) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    if (errors.empty()) return {0, kNone, kNone, kNone, kNone, kNone};
    std::sort(errors.begin(), errors.end());
    const auto percentile = [&](double share) {
        const double rank = share * static_cast<double>(errors.size() - 1);
        const auto below = static_cast<std::size_t>(rank);
        const std::size_t above = std::min(below + 1, errors.size() - 1);
        return errors[below] +
               (rank - static_cast<double>(below)) * (errors[above] - errors[below]);
    };
    double sum = 0, squares = 0;
    for (const double error : errors) {
        sum += error;
        squares += error * error;
    }
    const auto count = static_cast<double>(errors.size());
    return {errors.size(),    percentile(0.5), sum / count, std::sqrt(squares / count),
            percentile(0.95), errors.back()};
}

double ScoreGroup::lost_share() const {
    return visible_points > 0
               ? static_cast<double>(lost_visible) / static_cast<double>(visible_points)
               : 0;
}

Score score_folder(const std::filesystem::path& folder, const std::filesystem::path& truth,
                   const FrameRange& range) {
    const TrackedPoints tracked = read_tracked(folder / "points.csv");
    const States states = read_states(folder / "frames.csv");
    CsvReader csv(truth, {"frame", "id", "x", "y", "z", "visible"});

    Group all;
    std::map<std::string, Group> groups;
    std::set<std::int64_t> frames_with_visible;
    while (csv.next()) {
        const Key key{csv.integer(0), csv.integer(1)};
        if (key.frame < range.first || (range.last && key.frame >= *range.last)) continue;
        const std::int64_t visible = csv.integer(5);
        if (visible != 0 && visible != 1) csv.fail("visible: 0 or 1 was expected.");
        const std::array<double, 3> true_xyz{csv.number(2), csv.number(3), csv.number(4)};
        std::optional<double> error;
        if (const auto found = tracked.find(key);
            found != tracked.end() && found->second.has_position) {
            const auto& xyz = found->second.xyz;
            error = std::hypot(xyz[0] - true_xyz[0], xyz[1] - true_xyz[1], xyz[2] - true_xyz[2]);
        }
        if (visible == 1) frames_with_visible.insert(key.frame);
        all.add(key.frame, visible == 1, error);
        if (const auto state = states.of_frame.find(key.frame); state != states.of_frame.end()) {
            groups[state->second].add(key.frame, visible == 1, error);
        }
    }
    if (all.frames.empty()) csv.fail("the truth holds no row of the frames asked for.");

    Score score;
    score.frames_without_visible = all.frames.size() - frames_with_visible.size();
    score.all = all.finish("all");
    for (const std::string& state : states.order) {
        if (const auto group = groups.find(state); group != groups.end()) {
            score.states.push_back(group->second.finish(state));
        }
    }
    return score;
}

std::string score_table(const Score& score) {
    std::string table = padded("errors in mm", 22, false);
    for (const char* name : {"points", "median", "mean", "rmse", "p95", "max", "lost"})
        table += padded(name, 9);
    table += "\n";
    const auto percent = [](const ScoreGroup& group) {
        return format_fixed(100 * group.lost_share(), 2) + " %";
    };
    table += table_line("visible", score.all.visible, percent(score.all));
    table += table_line("hidden", score.all.hidden, "");
    for (const ScoreGroup& group : score.states) {
        table += table_line("  " + group.name + " visible", group.visible, percent(group));
        if (group.hidden.count > 0)
            table += table_line("  " + group.name + " hidden", group.hidden, "");
    }
    table += std::to_string(score.all.frames) + " frames";
    if (score.frames_without_visible > 0) {
        table += ", " + std::to_string(score.frames_without_visible) +
                 " of them without a visible point (not counted in lost)";
    }
    return table + "\n";
}

nlohmann::ordered_json score_json(const Score& score) {
    Json json = group_json(score.all);
    json["frames_without_visible"] = score.frames_without_visible;
    json["states"] = Json::object();
    for (const ScoreGroup& group : score.states) json["states"][group.name] = group_json(group);
    return json;
}

std::string exceeded(const Score& score, std::optional<double> max_median,
                     std::optional<double> max_p95) {
    std::string message;
    const ErrorSummary& visible = score.all.visible;
    const auto check = [&](const char* name, double value, std::optional<double> limit) {
        if (!limit || (visible.count > 0 && value <= *limit)) return;
        message += (message.empty() ? "" : "; ");
        message += std::string(name) + " over visible points is " +
                   (visible.count > 0 ? format_fixed(value, 3) + " mm"
                                      : std::string("not to be had, all are lost")) +
                   ", asked were at most " + format_fixed(*limit, 3) + " mm";
    };
    check("the median", visible.median, max_median);
    check("the 95th percentile", visible.p95, max_p95);
    return message.empty() ? message : message + ".";
}

}  // namespace defrec::cli
