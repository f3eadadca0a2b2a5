// See comparison.hpp.
#include "conformance/cases/sequence/comparison.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "sdk/base/util/error.hpp"

namespace defrec::conformance {
namespace {

template <class A, class B>
double distance(const A* a, const B* b) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
        const double difference = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        sum += difference * difference;
    }
    return std::sqrt(sum);
}

const char* state_name(uint32_t state) {
    static constexpr const char* kNames[] = {"initialising", "tracking", "degraded", "lost",
                                             "relocalised"};
    return state < std::size(kNames) ? kNames[state] : "an unknown state";
}

// Degraded is tracking with a reason.
uint32_t followed_as(const TrackedFrame& frame) {
    return frame.state == DEFREC_DEGRADED ? uint32_t{DEFREC_TRACKING} : frame.state;
}

std::string describe(const TrackedFrame& frame) {
    return concat(state_name(frame.state), " with reasons ", frame.reasons, " in epoch ",
                  frame.epoch, ", template epoch ", frame.template_epoch, " and ",
                  frame.vertices.size() / 3, " vertices");
}

// Whether two frames have as many vertices: near enough, where tissue has joined.
bool as_large(const Track& track, const TrackedFrame& expected, const TrackedFrame& found) {
    constexpr double kMostOther = 0.02;
    const size_t first = track.frames.front().vertices.size();
    if (expected.vertices.size() == found.vertices.size()) return true;
    const double apart = std::abs(static_cast<double>(expected.vertices.size()) -
                                  static_cast<double>(found.vertices.size()));
    return expected.vertices.size() > first && found.vertices.size() > first &&
           apart <= kMostOther * static_cast<double>(expected.vertices.size());
}

// Blue, where share is 0, over white to red.
std::array<uint8_t, 3> colour(double share) {
    const double s = std::isnan(share) ? 1 : std::clamp(share, 0.0, 1.0);
    const double low = std::min(1.0, 2 * s), high = std::max(0.0, 2 * s - 1);
    return {static_cast<uint8_t>(40 + 215 * low), static_cast<uint8_t>(70 + 185 * low - 215 * high),
            static_cast<uint8_t>(235 - 195 * high)};
}

Picture dimmed(const RenderedSequence& sequence, size_t frame, std::string title) {
    const std::vector<uint8_t>& bgr = sequence.frames[frame].left;
    Picture picture{std::move(title), sequence.request.width, sequence.request.height,
                    std::vector<uint8_t>(bgr.size())};
    for (size_t i = 0; i < bgr.size(); i += 3)
        for (size_t k = 0; k < 3; ++k)
            picture.pixels[i + k] = static_cast<uint8_t>((bgr[i] + bgr[i + 1] + bgr[i + 2]) / 6);
    return picture;
}

void dot(Picture& picture, const defrec_camera& camera, const float* xyz, double share) {
    if (!(xyz[2] > 0)) return;
    const double u = camera.fx * xyz[0] / xyz[2] + camera.cx,
                 v = camera.fy * xyz[1] / xyz[2] + camera.cy;
    const std::array<uint8_t, 3> rgb = colour(share);
    for (double y = std::round(v) - 1; y <= std::round(v) + 1; ++y)
        for (double x = std::round(u) - 1; x <= std::round(u) + 1; ++x)
            if (x >= 0 && y >= 0 && x < picture.width && y < picture.height)
                std::copy(
                    rgb.begin(), rgb.end(),
                    picture.pixels.begin() + 3 * (static_cast<std::ptrdiff_t>(y) * picture.width +
                                                  static_cast<std::ptrdiff_t>(x)));
}

}  // namespace

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    if (std::any_of(values.begin(), values.end(), [](double value) { return std::isnan(value); }))
        return std::nan("");
    const auto rank =
        static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(values.size())));
    const auto at = values.begin() + std::max<std::ptrdiff_t>(rank - 1, 0);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

TruthErrors errors_to_truth(const Track& track, const RenderedSequence& sequence) {
    TruthErrors result;
    for (size_t i = 0; i < sequence.frames.size(); ++i) {
        const TrackedFrame& frame = track.frames[i];
        for (size_t point = 0; point < sequence.frames[i].truth.size(); ++point) {
            const TruePoint& truth = sequence.frames[i].truth[point];
            const bool trusted = frame.has_surface() && track.on_surface[point] != 0 &&
                                 frame.point_status[point] != DEFREC_POINT_UNKNOWN;
            const bool observed = trusted && frame.point_status[point] == DEFREC_POINT_OBSERVED;
            if (truth.visible) {
                ++result.visible;
                if (!trusted) ++result.lost;
            }
            if (!trusted || !(truth.visible || observed)) continue;
            double rectified[3];
            for (size_t row = 0; row < 3; ++row) {
                const double* r = &track.rectification[3 * row];
                rectified[row] =
                    r[0] * truth.position[0] + r[1] * truth.position[1] + r[2] * truth.position[2];
            }
            const double error = distance(rectified, &frame.points[3 * point]);
            if (truth.visible) result.errors.push_back(error);
            if (observed) result.observed.push_back(error);
        }
    }
    return result;
}

StateDifference state_difference(const Track& expected, const Track& found) {
    StateDifference result;
    for (size_t i = 0; i < expected.frames.size(); ++i) {
        const TrackedFrame &a = expected.frames[i], &b = found.frames[i];
        const std::string message =
            concat("frame ", i, " is ", describe(b), ", ", describe(a), " expected");
        if (followed_as(a) != followed_as(b) || a.epoch != b.epoch ||
            a.template_epoch != b.template_epoch || !as_large(expected, a, b)) {
            result.other_state = message;
            break;
        }
        const uint32_t differing = a.reasons ^ b.reasons;
        if ((differing & DEFREC_REASON_CONTRADICTED) != 0) ++result.other_contradicted;
        if ((a.state != b.state || (differing & ~uint32_t{DEFREC_REASON_CONTRADICTED}) != 0) &&
            result.other_reasons++ == 0)
            result.reasons_message = message;
    }
    return result;
}

TrackDistance distance_between(const Track& expected, const Track& found) {
    TrackDistance result;
    double worst = 0;
    for (size_t i = 0; i < expected.frames.size(); ++i) {
        const TrackedFrame &a = expected.frames[i], &b = found.frames[i];
        if (!a.has_surface() || !b.has_surface()) continue;
        const size_t count = expected.frames.front().vertex_status.size();
        for (size_t vertex = 0; vertex < count; ++vertex) {
            const uint8_t status = a.vertex_status[vertex];
            ++result.vertices;
            result.other_status += status == b.vertex_status[vertex] ? 0 : 1;
            if (status == DEFREC_POINT_UNKNOWN || b.vertex_status[vertex] == DEFREC_POINT_UNKNOWN)
                continue;
            const double apart = distance(&a.vertices[3 * vertex], &b.vertices[3 * vertex]);
            const bool observed =
                status == DEFREC_POINT_OBSERVED && b.vertex_status[vertex] == DEFREC_POINT_OBSERVED;
            (observed ? result.observed : result.extrapolated).push_back(apart);
            if (apart <= worst) continue;
            worst = apart;
            result.worst_frame = i;
        }
    }
    return result;
}

std::vector<Picture> distance_pictures(const Track& expected, const Track& found,
                                       const RenderedSequence& sequence, size_t frame,
                                       double full_scale) {
    const TrackedFrame &a = expected.frames[frame], &b = found.frames[frame];
    const std::string where = concat(" in frame ", frame);
    std::vector<Picture> pictures = {
        dimmed(sequence, frame, "expected depth" + where),
        dimmed(sequence, frame, "found depth" + where),
        dimmed(sequence, frame, concat("distance", where, "; red: ", full_scale, " mm and more"))};
    std::vector<double> depths;
    for (size_t i = 2; i < a.vertices.size(); i += 3) depths.push_back(a.vertices[i]);
    const double near = quantile(depths, 0.02),
                 range = std::max(quantile(depths, 0.98) - near, 1e-3);
    for (size_t i = 0; i + 2 < std::min(a.vertices.size(), b.vertices.size()); i += 3) {
        dot(pictures[0], expected.camera, &a.vertices[i], (a.vertices[i + 2] - near) / range);
        dot(pictures[1], expected.camera, &b.vertices[i], (b.vertices[i + 2] - near) / range);
        dot(pictures[2], expected.camera, &a.vertices[i],
            distance(&a.vertices[i], &b.vertices[i]) / full_scale);
    }
    return pictures;
}

}  // namespace defrec::conformance
