// See point_history.hpp.
#include "sdk/report/point_history.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

namespace defrec::cli {
namespace {

std::int16_t quantise_pixel(float pixel) {
    if (!std::isfinite(pixel)) return kNoPixel;
    return static_cast<std::int16_t>(
        std::lround(std::clamp(double{pixel} / kPixelStep, -32767.0, 32767.0)));
}

std::uint16_t quantise_error(float mm) {
    if (!std::isfinite(mm)) return 65535;
    return static_cast<std::uint16_t>(
        std::lround(std::clamp(double{mm} / kPointErrorStepMm, 0.0, 65535.0)));
}

std::vector<std::uint16_t> largest_of(const std::vector<const PointEstimate*>& points) {
    std::vector<std::uint16_t> largest;
    for (const PointEstimate* point : points)
        largest.push_back(point->status == VertexStatus::unknown
                              ? std::uint16_t{0}
                              : std::max(std::uint16_t{1}, quantise_error(expected_error(*point))));
    return largest;
}

// Keeps what is known of a moment that is left out in the one before it.
void merge_largest(PointMoment& kept, const PointMoment& left_out) {
    kept.largest.resize(std::max(kept.largest.size(), left_out.largest.size()));
    for (std::size_t i = 0; i < left_out.largest.size(); ++i)
        kept.largest[i] = std::max(kept.largest[i], left_out.largest[i]);
}

}  // namespace

PointHistory::PointHistory(Projector projector) : projector_(std::move(projector)) {}

// Takes points that were not there before: of the first ones evenly chosen, of later ones those for
// which there is room.
void PointHistory::choose(std::int64_t frame, const std::vector<PointEstimate>& given) {
    std::vector<const PointEstimate*> fresh;
    for (const PointEstimate& point : given)
        if (point.is_chosen && seen_.insert(point.id).second) fresh.push_back(&point);
    const std::size_t room = kListed - facts_.size();
    const std::size_t stride =
        room > 0 ? std::max<std::size_t>(1, (fresh.size() + room - 1) / room) : fresh.size() + 1;
    for (std::size_t i = 0; i < fresh.size(); ++i) {
        if (i % stride != 0 || facts_.size() == kListed) continue;
        facts_.push_back({fresh[i]->id, fresh[i]->name, frame, {}, {}, 0});
    }
}

void PointHistory::add(std::int64_t frame, double timestamp_ms,
                       const std::vector<PointEstimate>& given) {
    choose(frame, given);
    if (facts_.empty()) return;
    std::unordered_map<std::int64_t, const PointEstimate*> by_id;
    for (const PointEstimate& point : given)
        if (point.is_chosen) by_id.emplace(point.id, &point);
    static const PointEstimate kRemoved;
    std::vector<const PointEstimate*> points;
    for (PointFacts& facts : facts_) {
        const auto found = by_id.find(facts.id);
        points.push_back(found == by_id.end() ? &kRemoved : found->second);
        if (found == by_id.end()) continue;
        const PointEstimate& point = *found->second;
        facts.name = point.name;
        ++facts.frames[static_cast<std::size_t>(point.status)];
        if (point.status == VertexStatus::unknown) continue;
        const auto error = static_cast<double>(expected_error(point));
        facts.error_mm.add(error);
        facts.largest_mm = std::max(facts.largest_mm, error);
    }
    if (moments_.offer()) {
        moments_.keep(moment(frame, timestamp_ms, points), merge_largest);
    } else {
        PointMoment left_out;
        left_out.largest = largest_of(points);
        moments_.add_to_last(left_out, merge_largest);
    }
}

PointMoment PointHistory::moment(std::int64_t frame, double timestamp_ms,
                                 const std::vector<const PointEstimate*>& points) const {
    PointMoment moment;
    moment.frame = frame;
    moment.timestamp_ms = timestamp_ms;
    std::vector<float> xyz;
    for (const PointEstimate* point : points) {
        const bool is_known = point->status != VertexStatus::unknown;
        for (const float coordinate : point->xyz)
            xyz.push_back(is_known ? coordinate : std::numeric_limits<float>::quiet_NaN());
        moment.status.push_back(static_cast<std::uint8_t>(point->status));
        moment.error.push_back(is_known ? quantise_error(expected_error(*point)) : 65535);
    }
    moment.largest = largest_of(points);
    std::vector<float> uv(2 * points.size());
    projector_(xyz.data(), points.size(), uv.data());
    for (const float pixel : uv) moment.uv.push_back(quantise_pixel(pixel));
    moment.points = quantise(xyz);
    return moment;
}

std::vector<PointEstimate> points_of_plan(const PlanEstimate& plan) {
    std::vector<PointEstimate> points = plan.parts;
    for (PointEstimate& part : points) part.id = -1 - part.id;
    points.insert(points.end(), plan.targets.begin(), plan.targets.end());
    for (PointEstimate& point : points) point.is_chosen = true;
    return points;
}

PointErrors point_errors(const FrameRecord& frame) {
    PointErrors result{std::nan(""), std::nan(""), 0, 0};
    std::vector<float> errors;
    for (const PointEstimate& point : frame.points) {
        if (!point.is_chosen) continue;
        ++result.chosen;
        if (point.status == VertexStatus::unknown)
            ++result.lost;
        else
            errors.push_back(expected_error(point));
    }
    if (errors.empty()) return result;
    const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    result.median_mm = static_cast<double>(*middle);
    result.largest_mm = static_cast<double>(*std::max_element(errors.begin(), errors.end()));
    return result;
}

}  // namespace defrec::cli
