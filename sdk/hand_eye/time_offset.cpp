// See time_offset.hpp.
#include "sdk/hand_eye/time_offset.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "sdk/base/util/error.hpp"
#include "sdk/hand_eye/decisions.hpp"
#include "sdk/hand_eye/speed_correlation.hpp"

namespace defrec {
namespace {

using decisions::HandEyeOffset;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Without single poses that are turned against those beside them: they would seem to be fast.
PoseStream without_spikes(const PoseStream& stream) {
    const std::vector<TimedPose>& poses = stream.poses();
    if (poses.size() < HandEyeOffset::kMinSpikes) return stream;
    std::vector<double> away(poses.size(), 0);
    for (std::size_t i = 1; i + 1 < poses.size(); ++i) {
        const Eigen::Matrix3d &before = poses[i - 1].pose.linear(), &now = poses[i].pose.linear(),
                              &after = poses[i + 1].pose.linear();
        away[i] = (turn_of(now.transpose() * before) + turn_of(now.transpose() * after)).norm() / 2;
    }
    std::vector<double> sorted = away;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double most = std::max(HandEyeOffset::kSpikeRatio * *middle, HandEyeOffset::kMinSpike);
    std::vector<TimedPose> kept{poses.front()};
    for (std::size_t i = 1; i + 1 < poses.size(); ++i)
        if (away[i] <= most || away[i] < away[i - 1] || away[i] < away[i + 1])
            kept.push_back(poses[i]);
    kept.push_back(poses.back());
    return {std::move(kept), "poses"};
}

// rad / s at begin, begin + step ...; NaN where a pose is missing.
std::vector<double> speeds(const PoseStream& stream, double begin, double step, std::size_t count) {
    std::vector<double> made(count, kNone);
    for (std::size_t i = 0; i < count; ++i) {
        const double time = begin + step * static_cast<double>(i);
        const auto before = stream.at(time - HandEyeOffset::kWindow / 2),
                   after = stream.at(time + HandEyeOffset::kWindow / 2);
        if (!before || !after) continue;
        const Eigen::Matrix3d turn = before->pose.linear().transpose() * after->pose.linear();
        made[i] = turn_of(turn).norm() / HandEyeOffset::kWindow;
    }
    // Poses that are wrong would count more than all others.
    std::vector<double> known;
    std::copy_if(made.begin(), made.end(), std::back_inserter(known),
                 [](double speed) { return !std::isnan(speed); });
    if (known.empty()) return made;
    const auto middle = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2);
    std::nth_element(known.begin(), middle, known.end());
    const double most = HandEyeOffset::kMostSpeed * *middle;
    for (double& speed : made)
        if (speed > most) speed = most;
    return made;
}

// How far the top of a parabola through three values lies from the middle one, in their steps.
double top_of(double before, double middle, double after) {
    const double bend = before - 2 * middle + after;
    if (!(bend < 0)) return 0;
    return std::clamp(0.5 * (before - after) / bend, -0.5, 0.5);
}

// The largest value at a peak that is farther than the window from `best`.
double other_peak(const std::vector<double>& values, std::size_t best, double step) {
    double other = -1;
    for (std::size_t i = 1; i + 1 < values.size(); ++i) {
        const double away = std::abs(static_cast<double>(i) - static_cast<double>(best)) * step;
        if (away > HandEyeOffset::kWindow && values[i] >= values[i - 1] &&
            values[i] >= values[i + 1])
            other = std::max(other, values[i]);
    }
    return other;
}

OffsetSearch peak_of(const std::vector<double>& values, double step, double max_offset_s) {
    const std::size_t reach = values.size() / 2;
    const double first = -step * static_cast<double>(reach);
    OffsetSearch found;
    std::size_t best = values.size();
    for (std::size_t i = 0; i < values.size(); ++i)
        if (!std::isnan(values[i]) && (best == values.size() || values[i] > values[best])) best = i;
    if (best == values.size()) {
        found.reason = concat("the streams overlap by less than ", HandEyeOffset::kMinOverlap,
                              " s, or their speed of rotation does not change");
        return found;
    }
    found.correlation = values[best];
    found.offset_s = first + step * static_cast<double>(best);
    if (values[best] < HandEyeOffset::kMinCorrelation) {
        found.reason =
            concat("the speeds of rotation of camera and marker are not alike at any offset up to ",
                   max_offset_s, " s: their correlation is ", std::round(100 * values[best]) / 100,
                   " at most, expected ", HandEyeOffset::kMinCorrelation);
        return found;
    }
    if (best == 0 || best + 1 == values.size() || std::isnan(values[best - 1]) ||
        std::isnan(values[best + 1])) {
        found.reason =
            concat("the offset is at or beyond the end of what is searched, ", max_offset_s, " s");
        return found;
    }
    if (values[best] - other_peak(values, best, step) < HandEyeOffset::kMinLead) {
        found.reason =
            "several offsets fit alike: the motion repeats itself, or hardly changes its speed";
        return found;
    }
    found.offset_s += step * top_of(values[best - 1], values[best], values[best + 1]);
    found.is_found = true;
    return found;
}

}  // namespace

OffsetSearch find_offset(const PoseStream& all_camera, const PoseStream& all_tracker,
                         double max_offset_s) {
    const PoseStream camera = without_spikes(all_camera), tracker = without_spikes(all_tracker);
    OffsetSearch found;
    const double interval = std::max(camera.interval(), tracker.interval());
    if (interval <= 0 || interval * HandEyeOffset::kMinSamples > HandEyeOffset::kWindow) {
        found.reason = concat("a stream has a pose every ", std::round(1000 * interval) / 1000,
                              " s only, expected at most ",
                              HandEyeOffset::kWindow / HandEyeOffset::kMinSamples, " s");
        return found;
    }
    const double step =
        std::max(HandEyeOffset::kMinStep, std::min(camera.interval(), tracker.interval()));
    const auto reach = static_cast<std::size_t>(std::ceil(max_offset_s / step));
    const double begin = camera.begin(), length = camera.end() - begin;
    if (length > HandEyeOffset::kMaxLength) {
        found.reason = concat("the camera's stream lasts ", length, " s, expected at most ",
                              HandEyeOffset::kMaxLength, " s");
        return found;
    }
    const auto count = static_cast<std::size_t>(length / step) + 1;
    const double margin = step * static_cast<double>(reach);
    const std::vector<double> turns = speeds(camera, begin, step, count),
                              marker_turns =
                                  speeds(tracker, begin - margin, step, count + 2 * reach);
    const auto min_count = static_cast<std::size_t>(HandEyeOffset::kMinOverlap / step);
    return peak_of(correlations(turns, marker_turns, min_count), step, max_offset_s);
}

}  // namespace defrec
