// Samples and quantises the surfaces.
#include "sdk/report/surface_history.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sdk/report/ellipsoid.hpp"

namespace defrec::cli {
namespace {

constexpr std::uint16_t kNoPosition = 65535;
constexpr float kSteps = 65534;

std::uint8_t quantise_error(float mm) {
    if (!std::isfinite(mm)) return 255;
    return static_cast<std::uint8_t>(
        std::lround(std::clamp(double(mm) / kErrorStepMm, 0.0, 254.0)));
}

/// From one that is kept to the next.
std::size_t stride_of(std::size_t count, std::size_t most) {
    return std::max<std::size_t>(1, (count + most - 1) / most);
}

template <typename Estimate>
Ellipsoids ellipsoids(const std::vector<Estimate>& points, std::size_t most) {
    const std::size_t stride = stride_of(points.size(), most);
    Ellipsoids result;
    std::vector<float> centres;
    for (std::size_t i = 0; i < points.size(); i += stride) {
        const PointEstimate& point = points[i];
        const bool is_known = point.status != VertexStatus::unknown;
        for (const float coordinate : point.xyz)
            centres.push_back(is_known ? coordinate : std::numeric_limits<float>::quiet_NaN());
        const auto shape = ellipsoid_shape(point.covariance);
        result.shapes.insert(result.shapes.end(), shape.begin(), shape.end());
        result.status.push_back(static_cast<std::uint8_t>(point.status));
    }
    result.points = quantise(centres);
    return result;
}

std::vector<TargetLabel> labels_of(const std::vector<TargetEstimate>& targets) {
    const std::size_t stride = stride_of(targets.size(), SurfaceHistory::kTargets);
    std::vector<TargetLabel> labels;
    for (std::size_t i = 0; i < targets.size(); i += stride)
        labels.push_back({targets[i].id, targets[i].depth});
    return labels;
}

void add_plan(const LightPlan& light, const PlanEstimate& plan, SurfaceMoment& moment) {
    const std::vector<float> xyz = light.positions(plan);
    if (xyz.empty()) return;
    moment.plan = quantise(xyz);
    for (const float error : light.expected_error_mm(plan))
        moment.plan_error.push_back(quantise_error(error));
    moment.plan_targets = ellipsoids(plan.targets, SurfaceHistory::kTargets);
}

}  // namespace

QuantisedPoints quantise(const std::vector<float>& xyz) {
    QuantisedPoints result;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        float low = std::numeric_limits<float>::infinity(), high = -low;
        for (std::size_t i = axis; i < xyz.size(); i += 3)
            if (std::isfinite(xyz[i])) low = std::min(low, xyz[i]), high = std::max(high, xyz[i]);
        if (low > high) low = high = 0;
        result.lowest[axis] = low;
        result.step[axis] = (high - low) / kSteps;
    }
    result.xyz.resize(xyz.size(), kNoPosition);
    for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) {
        if (!std::isfinite(xyz[i]) || !std::isfinite(xyz[i + 1]) || !std::isfinite(xyz[i + 2]))
            continue;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float step = result.step[axis];
            const float value = step > 0 ? (xyz[i + axis] - result.lowest[axis]) / step : 0;
            result.xyz[i + axis] =
                static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0f, kSteps)));
        }
    }
    return result;
}

void SurfaceHistory::set_template(const TemplateRecord& reference) {
    check_template(reference);
    if (vertices_ > 0) moments_ = EvenlyThinned<SurfaceMoment>(kMoments);
    vertices_ = reference.vertices.size() / 3;
    step_ = std::max(1.0, std::sqrt(template_area(reference) / kPoints));
    lattice_ = SurfaceLattice(reference, step_);
    rest_ = quantise(lattice_.evaluate(reference.vertices));
}

void SurfaceHistory::change_template(const TemplateRecord& reference) {
    TemplateRecord kept;
    const auto coordinates = static_cast<std::ptrdiff_t>(vertices_);
    kept.vertices.assign(reference.vertices.begin(), reference.vertices.begin() + 3 * coordinates);
    kept.vertex_uv.assign(reference.vertex_uv.begin(),
                          reference.vertex_uv.begin() + 2 * coordinates);
    for (std::size_t i = 0; i + 2 < reference.triangles.size(); i += 3) {
        const std::uint32_t* corner = reference.triangles.data() + i;
        if (*std::max_element(corner, corner + 3) < vertices_)
            kept.triangles.insert(kept.triangles.end(), corner, corner + 3);
    }
    lattice_.part_like(SurfaceLattice(kept, step_));
}

void SurfaceHistory::add(const FrameRecord& frame, const std::string& state) {
    if (!moments_.offer()) return;
    SurfaceMoment moment;
    moment.frame = frame.index;
    moment.timestamp_ms = frame.timestamp_ms;
    moment.state = state;
    moment.reasons = frame.reasons;
    moment.rigid = frame.rigid;
    if (vertices_ > 0 && frame.vertices.size() >= 3 * vertices_ &&
        has_geometry(frame, frame.vertices.size() / 3)) {
        moment.mean_residual_mm = frame.mean_residual_mm;
        lattice_.evaluate(frame, state_);
        moment.points = quantise(state_.xyz);
        for (const VertexStatus status : state_.status)
            moment.status.push_back(static_cast<std::uint8_t>(status));
        if (!frame.expected_error_mm.empty())
            for (const float error : state_.error_mm) moment.error.push_back(quantise_error(error));
        moment.ellipsoids = ellipsoids(frame.points, kEllipsoids);
        moment.targets = ellipsoids(frame.targets, kTargets);
        if (target_labels_.empty()) {
            target_labels_ = labels_of(frame.targets);
            target_count_ = frame.targets.size();
        }
        if (plan_.is_empty() && frame.plan.model && !frame.plan.vertices.empty())
            plan_ = LightPlan(frame.plan);
        if (!plan_.is_empty()) add_plan(plan_, frame.plan, moment);
    }
    moments_.keep(std::move(moment));
}

}  // namespace defrec::cli
