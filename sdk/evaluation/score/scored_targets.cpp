// Targets beneath the surface beside their truth.
#include "sdk/evaluation/score/scored_targets.hpp"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "sdk/evaluation/score/rigid_fit.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

using PointsById = std::unordered_map<std::int64_t, Xyz>;

cv::Vec3d vector_of(const Xyz& xyz) { return {xyz[0], xyz[1], xyz[2]}; }

// The points of the surface that can be seen in each frame.
std::map<std::int64_t, PointsById> read_visible(const fs::path& path) {
    CsvReader csv(path, {"frame", "id", "x", "y", "z", "visible"});
    std::map<std::int64_t, PointsById> frames;
    while (csv.next()) {
        if (csv.integer(5) == 0) continue;
        frames[csv.integer(0)][csv.integer(1)] = {csv.number(2), csv.number(3), csv.number(4)};
    }
    return frames;
}

// From the first frame to each.
std::map<std::int64_t, Pose> rigid_motions(const fs::path& path) {
    constexpr std::size_t kMinPoints = 3;
    std::map<std::int64_t, Pose> motions;
    if (path.empty()) return motions;
    const std::map<std::int64_t, PointsById> frames = read_visible(path);
    for (const auto& [frame, points] : frames) {
        std::vector<cv::Vec3d> from, to;
        for (const auto& [id, xyz] : points) {
            const PointsById& first = frames.begin()->second;
            const auto start = first.find(id);
            if (start == first.end()) continue;
            from.push_back(vector_of(start->second));
            to.push_back(vector_of(xyz));
        }
        if (from.size() < kMinPoints) continue;
        motions[frame] = rigid_fit(from, to, std::vector<double>(from.size(), 1));
    }
    return motions;
}

struct TrueTarget {
    FrameAndId key;
    double depth = 0;
    Xyz xyz{};
};

std::vector<TrueTarget> read_truth(const fs::path& path) {
    CsvReader csv(path, {"frame", "id", "depth", "x", "y", "z"});
    std::vector<TrueTarget> truth;
    std::unordered_set<FrameAndId, FrameAndIdHash> keys;
    while (csv.next()) {
        const FrameAndId key{csv.integer(0), csv.integer(1)};
        if (!keys.insert(key).second) csv.fail(repeated(key));
        truth.push_back({key, csv.number(2), {csv.number(3), csv.number(4), csv.number(5)}});
    }
    if (truth.empty()) csv.fail("the truth holds no row.");
    return truth;
}

// The frame in which rigid motions start.
PointsById places_at(std::int64_t frame, const std::vector<TrueTarget>& truth) {
    PointsById places;
    for (const TrueTarget& target : truth)
        if (target.key.frame == frame) places[target.key.id] = target.xyz;
    return places;
}

}  // namespace

ScoredTargets read_scored_targets(const fs::path& tracked, const fs::path& truth,
                                  const fs::path& surface_truth, const FrameRange& range,
                                  Unfollowed unfollowed) {
    const TrackedPositions positions = read_tracked(tracked);
    const std::map<std::int64_t, Pose> motions = rigid_motions(surface_truth);
    const std::vector<TrueTarget> true_targets = read_truth(truth);
    const PointsById starts =
        motions.empty() ? PointsById() : places_at(motions.begin()->first, true_targets);
    TruthCheck check(positions, "target", unfollowed);
    ScoredTargets scored;
    for (const TrueTarget& target : true_targets) {
        const bool is_scored = is_within(range, target.key.frame);
        check.add(target.key, target.xyz, true, is_scored);
        if (!is_scored) continue;
        ScoredTarget row;
        row.frame = target.key.frame;
        row.is_followed = check.is_followed(target.key.id);
        row.depth = target.depth;
        if (const TrackedPosition* position = find(positions, target.key))
            row.compare(*position, target.xyz);
        const auto motion = motions.find(target.key.frame);
        const auto start = starts.find(target.key.id);
        if (motion != motions.end() && start != starts.end()) {
            const Pose& pose = motion->second;
            row.rigid_mm = cv::norm(pose.rotation * vector_of(start->second) + pose.position -
                                    vector_of(target.xyz));
        }
        scored.rows.push_back(std::move(row));
    }
    check.finish();
    if (scored.rows.empty())
        throw CliError(ExitCode::kInput, check.no_row_of(truth.string(), range));
    if (unfollowed == Unfollowed::kLeftOut) leave_out_unfollowed(scored.rows);
    scored.not_followed = check.not_followed();
    scored.notes = check.notes(truth.string(), tracked.filename().string());
    scored.doubt = check.doubt(truth.string(), tracked.filename().string());
    return scored;
}

}  // namespace defrec::cli
