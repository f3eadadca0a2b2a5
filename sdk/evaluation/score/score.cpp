// How far tracked points are from the truth.
#include "sdk/evaluation/score/score.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "sdk/evaluation/score/sparsification.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

StatusConfidence confidence_of(const std::string& status, const std::vector<ErrorSample>& samples) {
    return {status, coverage_of(samples), ause_of(sparsification_of(samples))};
}

// Collects the rows of one group.
class Group {
  public:
    void add(const ScoredRow& row) {
        frames_.insert(row.frame);
        const bool said_visible = row.status == name_of(PointStatus::kTracked);
        constexpr double kFar = std::numeric_limits<double>::infinity();
        rows_.push_back({row.truly_visible, said_visible, row.error_mm.value_or(kFar),
                         row.error_px.value_or(kFar)});
        group_.visible_points += row.truly_visible ? 1 : 0;
        if (!row.error_mm) {
            group_.lost_visible += row.truly_visible ? 1 : 0;
            return;
        }
        const double error = *row.error_mm;
        (row.truly_visible ? visible_ : hidden_).push_back(error);
        constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
        samples_[row.status].push_back({error, row.expected_mm.value_or(kNone)});
        if (said_visible) {
            TrackedErrors& tracked = group_.tracked;
            ++tracked.count;
            tracked.max = std::max(tracked.max, error);
            tracked.off += error > TrackedErrors::kOffMm ? 1 : 0;
        }
    }

    const SamplesByStatus& samples() const { return samples_; }

    ScoreGroup finish(const std::string& name, bool with_pixels) {
        group_.name = name;
        group_.frames = frames_.size();
        group_.visible = summarise(std::move(visible_));
        group_.hidden = summarise(std::move(hidden_));
        std::vector<ErrorSample> all;
        for (const auto& [status, samples] : samples_) {
            group_.statuses.push_back(confidence_of(status, samples));
            all.insert(all.end(), samples.begin(), samples.end());
        }
        group_.all_statuses = confidence_of("all", all);
        group_.visibility = visibility_of(rows_, with_pixels);
        return std::move(group_);
    }

  private:
    ScoreGroup group_;
    std::set<std::int64_t> frames_;
    std::vector<double> visible_, hidden_;
    std::vector<VisibilitySample> rows_;
    SamplesByStatus samples_;
};

Json confidence_json(const StatusConfidence& confidence) {
    Json json = coverage_json(confidence.coverage);
    json["ause"] = confidence.ause;
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
    json["tracked"] = {{"count", group.tracked.count},
                       {"max_mm", group.tracked.max},
                       {"off_by_more_than_2_mm", group.tracked.off}};
    json["expected_errors"] = {{"all", confidence_json(group.all_statuses)}};
    for (const StatusConfidence& status : group.statuses)
        json["expected_errors"][status.status] = confidence_json(status);
    json["visibility"] = visibility_json(group.visibility);
    return json;
}

}  // namespace

double ScoreGroup::lost_share() const {
    return visible_points > 0
               ? static_cast<double>(lost_visible) / static_cast<double>(visible_points)
               : 0;
}

Score score_of(const ScoredRows& scored) {
    Group all;
    std::map<std::string, Group> groups;
    std::set<std::int64_t> frames_with_visible;
    for (const ScoredRow& row : scored.rows) {
        if (row.truly_visible) frames_with_visible.insert(row.frame);
        all.add(row);
        if (!row.state.empty()) groups[row.state].add(row);
    }
    Score score;
    score.notes = scored.notes;
    score.doubt = scored.doubt;
    score.not_followed = scored.not_followed;
    score.samples = all.samples();
    score.all = all.finish("all", scored.has_pixels);
    score.frames_without_visible = score.all.frames - frames_with_visible.size();
    for (const std::string& state : scored.states) {
        if (const auto group = groups.find(state); group != groups.end()) {
            score.states.push_back(group->second.finish(state, scored.has_pixels));
        }
    }
    return score;
}

nlohmann::ordered_json score_json(const Score& score) {
    Json json = group_json(score.all);
    json["not_followed"] = score.not_followed;
    json["frames_without_visible"] = score.frames_without_visible;
    json["states"] = Json::object();
    for (const ScoreGroup& group : score.states) json["states"][group.name] = group_json(group);
    json["notes"] = score.notes;
    json["is_truth_in_doubt"] = !score.doubt.note.empty();
    return json;
}

std::vector<std::string> exceeded(const Score& score, const ScoreLimits& limits) {
    std::vector<std::string> messages = exceeded("visible points", score.all.visible, limits);
    if (limits.calibrated) {
        for (std::string& message : miscalibrated(score.all.statuses))
            messages.push_back(std::move(message));
    }
    return messages;
}

}  // namespace defrec::cli
