// How far targets beneath the surface are from the truth, by their depth.
#include "sdk/evaluation/score/target_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "sdk/evaluation/score/plot.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Collects the targets of one depth.
class Group {
  public:
    void add(const ScoredTarget& target) {
        ++score_.rows;
        if (target.rigid_mm) rigid_.push_back(*target.rigid_mm);
        if (!target.error_mm) {
            ++score_.lost;
            return;
        }
        samples_[target.status].push_back({*target.error_mm, target.expected_mm.value_or(kNone)});
    }

    DepthScore finish(double min_depth, double max_depth) {
        score_.min_depth = min_depth;
        score_.max_depth = max_depth;
        score_.rigid = summarise(std::move(rigid_));
        std::vector<ErrorSample> all;
        for (const auto& [status, samples] : samples_) {
            score_.statuses.push_back(errors_of(status, samples));
            all.insert(all.end(), samples.begin(), samples.end());
        }
        score_.all = errors_of("all", all);
        return std::move(score_);
    }

  private:
    static TargetErrors errors_of(const std::string& status,
                                  const std::vector<ErrorSample>& samples) {
        std::vector<double> errors, expected;
        for (const ErrorSample& sample : samples) {
            errors.push_back(sample.error_mm);
            if (!std::isnan(sample.expected_mm)) expected.push_back(sample.expected_mm);
        }
        return {status, summarise(std::move(errors)), summarise(std::move(expected)).mean,
                coverage_of(samples)};
    }

    DepthScore score_;
    std::vector<double> rigid_;
    SamplesByStatus samples_;
};

// The width of ranges of depth; 0: each depth stands alone.
double range_width(const std::set<double>& depths) {
    constexpr std::size_t kMaxDepths = 12;
    if (depths.size() <= kMaxDepths) return 0;
    const std::vector<double> ticks = ticks_of({"", *depths.begin(), *depths.rbegin(), false});
    return ticks[1] - ticks[0];
}

Json errors_json(const TargetErrors& errors) {
    Json json = errors_json(errors.errors);
    json["mean_expected_mm"] = errors.mean_expected_mm;
    json["expected_errors"] = coverage_json(errors.coverage);
    return json;
}

Json depth_json(const DepthScore& depth) {
    Json json;
    json["min_depth_mm"] = depth.min_depth;
    json["max_depth_mm"] = depth.max_depth;
    json["points"] = depth.rows;
    json["lost"] = depth.lost;
    json["lost_share"] = depth.lost_share();
    json["all"] = errors_json(depth.all);
    json["statuses"] = Json::object();
    for (const TargetErrors& status : depth.statuses)
        json["statuses"][status.status] = errors_json(status);
    json["rigid_fit"] = errors_json(depth.rigid);
    return json;
}

// The shortest text with at most two decimals.
std::string millimetres(double value) {
    std::string text = format_fixed(value, 2);
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
    return text;
}

}  // namespace

double DepthScore::lost_share() const {
    return static_cast<double>(lost) / static_cast<double>(std::max<std::size_t>(1, rows));
}

std::string DepthScore::name() const {
    return (min_depth == max_depth ? "" : millimetres(min_depth) + " to ") +
           millimetres(max_depth) + " mm";
}

TargetScore target_score_of(const ScoredTargets& targets) {
    std::set<double> depths;
    for (const ScoredTarget& target : targets.rows) depths.insert(target.depth);
    TargetScore score;
    score.notes = targets.notes;
    score.doubt = targets.doubt;
    score.not_followed = targets.not_followed;
    if (depths.empty()) return score;
    const double width = range_width(depths);
    Group all;
    std::map<double, Group> groups;  // by their smallest depth
    for (const ScoredTarget& target : targets.rows) {
        all.add(target);
        groups[width > 0 ? width * std::floor(target.depth / width) : target.depth].add(target);
    }
    score.all = all.finish(*depths.begin(), *depths.rbegin());
    for (auto& [depth, group] : groups) score.depths.push_back(group.finish(depth, depth + width));
    return score;
}

std::vector<StatusConfidence> confidences_of(const TargetScore& score) {
    std::vector<StatusConfidence> statuses;
    for (const DepthScore& depth : score.depths)
        for (const TargetErrors& status : depth.statuses)
            statuses.push_back({depth.name() + " deep " + status.status, status.coverage, kNone});
    return statuses;
}

nlohmann::ordered_json target_json(const TargetScore& score) {
    Json json;
    json["all"] = depth_json(score.all);
    json["depths"] = Json::array();
    for (const DepthScore& depth : score.depths) json["depths"].push_back(depth_json(depth));
    json["not_followed"] = score.not_followed;
    json["notes"] = score.notes;
    json["is_truth_in_doubt"] = !score.doubt.note.empty();
    return json;
}

std::vector<std::string> exceeded(const TargetScore& score, const ScoreLimits& limits) {
    std::vector<std::string> messages;
    const auto add = [&](std::vector<std::string> more) {
        std::move(more.begin(), more.end(), std::back_inserter(messages));
    };
    for (const DepthScore& depth : score.depths)
        add(exceeded("targets " + depth.name() + " deep", depth.all.errors, limits));
    if (limits.calibrated) add(miscalibrated(confidences_of(score)));
    return messages;
}

}  // namespace defrec::cli
