#include "sdk/frame_state.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "backends/shared/motion.hpp"

namespace defrec {

ImageStatistics image_statistics(const uint8_t* pixels, uint32_t width, uint32_t height, uint32_t channels, const int32_t* map) {
    constexpr uint32_t kStep = 4;
    ImageStatistics statistics;
    double sum = 0, squares = 0;
    size_t count = 0, saturated = 0;
    uint64_t hash = 1469598103934665603u;  // FNV-1a over the green channel, or the only one
    const uint32_t channel = channels >= 3 ? 1 : 0;
    for (uint32_t y = kStep / 2; y < height; y += kStep) {
        const uint8_t* row = pixels + static_cast<size_t>(y) * width * channels;
        for (uint32_t x = kStep / 2; x < width; x += kStep) {
            if (map != nullptr && map[2 * (size_t{y} * width + x)] == INT32_MIN) continue;
            const uint8_t value = row[x * channels + channel];
            sum += value;
            squares += static_cast<double>(value) * value;
            saturated += value >= 250;
            hash = (hash ^ value) * 1099511628211u;
            ++count;
        }
    }
    if (count == 0) return statistics;
    const double n = static_cast<double>(count);
    statistics.mean = sum / n;
    statistics.deviation = std::sqrt(std::max(0.0, squares / n - statistics.mean * statistics.mean));
    statistics.saturated_share = static_cast<double>(saturated) / n;
    statistics.hash = hash;
    return statistics;
}

Evidence weigh_evidence(const TemplateData& data, const FrameOutput& output) {
    Evidence evidence;
    double residuals = 0;
    for (const defrec_surface_sample& sample : output.samples) {
        if (sample.observation == DEFREC_OUTSIDE) continue;
        ++evidence.vertices_inside;
        if (sample.observation == DEFREC_OBSERVED) {
            ++evidence.vertices_observed;
            residuals += std::abs(sample.residual);
        }
        evidence.vertices_occluded += sample.observation == DEFREC_OCCLUDED;
        evidence.vertices_without_depth += sample.observation == DEFREC_NO_DEPTH;
    }
    if (evidence.vertices_observed > 0) evidence.mean_residual_mm = residuals / evidence.vertices_observed;

    constexpr double kConfirmedPx = 2;
    double squares = 0;
    for (size_t i = 0; i < data.patches.size(); ++i) {
        if (output.predictions[i].valid == 0) continue;
        ++evidence.patches_expected;
        const defrec_patch_observation& observation = output.observations[i];
        if (observation.valid == 0) continue;
        const defrec_patch& patch = data.patches[i];
        const Vec3<double> p =
            apply(blend<double>(output.motions.data(), patch.node, patch.weight), load3<double>(patch.position));
        if (!(p.z > 0)) continue;
        const double du = data.camera.fx * p.x / p.z + data.camera.cx - observation.u / 256.0;
        const double dv = data.camera.fy * p.y / p.z + data.camera.cy - observation.v / 256.0;
        if (!(du * du + dv * dv <= kConfirmedPx * kConfirmedPx)) continue;
        ++evidence.patches_confirmed;
        squares += du * du + dv * dv;
    }
    if (evidence.patches_confirmed > 0) evidence.patch_rms_px = std::sqrt(squares / evidence.patches_confirmed);
    evidence.matches = static_cast<uint32_t>(std::max(0, output.summary->ransac.valid_matches));
    evidence.inliers = static_cast<uint32_t>(std::max(0, output.summary->ransac.inliers));
    return evidence;
}

Verdict judge(const TemplateData& data, const Evidence& evidence, bool was_found) {
    Verdict verdict;
    const auto inside_share = static_cast<double>(evidence.vertices_inside) / static_cast<double>(std::max<size_t>(1, data.vertices.size()));
    const double confirmed = evidence.confirmed_share(), observed = evidence.observed_share();
    // A wrong surface confirms one patch in fifty by chance, a right one in heavy smoke one in ten. What was followed up to here needs less
    // evidence than what is said to be found again.
    const uint32_t least_patches = was_found ? 30 : 60;
    const double least_share = was_found ? 0.05 : 0.12;
    const bool patches_agree = evidence.patches_confirmed >= least_patches && confirmed >= least_share;
    const bool features_agree = evidence.patches_confirmed >= 20 && confirmed >= least_share && evidence.inliers >= 15;
    verdict.found = (patches_agree || features_agree) && observed >= 0.1 && inside_share >= 0.05;

    if (confirmed < 0.45) verdict.reasons |= DEFREC_REASON_LOW_CONTRAST;
    if (evidence.inliers < 10) verdict.reasons |= DEFREC_REASON_FEW_MATCHES;
    const double inside = std::max(1u, evidence.vertices_inside);
    if (evidence.vertices_occluded / inside > 0.25) verdict.reasons |= DEFREC_REASON_OCCLUDED;
    if (evidence.vertices_without_depth / inside > 0.5) verdict.reasons |= DEFREC_REASON_NO_DEPTH;
    if (evidence.mean_residual_mm > 1.0) verdict.reasons |= DEFREC_REASON_LARGE_RESIDUAL;
    if (inside_share < 0.5) verdict.reasons |= DEFREC_REASON_OUT_OF_VIEW;
    verdict.degraded = (verdict.reasons & ~static_cast<uint32_t>(DEFREC_REASON_FEW_MATCHES)) != 0;
    return verdict;
}

namespace {

// Distance over the template's grid to the nearest observed vertex, in grid steps.
void distance_to_observed(const TemplateData& data, const FrameOutput& output, std::vector<float>& distance) {
    const SurfaceGrid& grid = data.grid;
    distance.resize(grid.vertex.size());
    for (size_t i = 0; i < distance.size(); ++i) {
        const int32_t vertex = grid.vertex[i];
        const bool observed = vertex >= 0 && output.samples[static_cast<size_t>(vertex)].observation == DEFREC_OBSERVED;
        distance[i] = observed ? 0.f : 1e6f;
    }
    spread_distance(distance, grid.columns, grid.rows);
}

}  // namespace

void believe(const TemplateData& data, const FrameOutput& output, bool lost, uint32_t age, VertexBelief& belief) {
    const SurfaceGrid& grid = data.grid;
    belief.status.resize(data.vertices.size());
    belief.expected_error.resize(data.vertices.size());
    distance_to_observed(data, output, belief.distance);
    constexpr double kDisparitySigmaPx = 0.15, kLateralSigmaMm = 0.1;
    constexpr double kGrowth = 0.06;            // mm of error per mm from the nearest observation
    constexpr double kFarthestMm = 40;          // extrapolation reaches no farther
    for (size_t cell = 0; cell < grid.vertex.size(); ++cell) {
        if (grid.vertex[cell] < 0) continue;
        const size_t vertex = static_cast<size_t>(grid.vertex[cell]);
        const defrec_surface_sample& sample = output.samples[vertex];
        const double z = std::max<double>(1, data.vertices[vertex].position[2]);
        const double step_mm = grid.spacing * z / data.camera.fx;
        const double depth_sigma = kDisparitySigmaPx * z * z / (data.camera.fx * data.camera.baseline_mm);
        const bool observed = sample.observation == DEFREC_OBSERVED;
        const double far = observed ? 0 : belief.distance[cell] * step_mm;
        const double unsupported = data.vertex_support[vertex] * z / data.camera.fx;
        const double residual = observed ? 0.3 * std::abs(sample.residual) : 0;
        double error = std::sqrt(depth_sigma * depth_sigma + kLateralSigmaMm * kLateralSigmaMm + residual * residual) + kGrowth * std::min(far, 100.0) + 0.03 * unsupported;
        if (lost) error += 0.5 * std::min(age, 100u);
        belief.expected_error[vertex] = static_cast<float>(error);
        belief.status[vertex] = lost || far > kFarthestMm ? DEFREC_POINT_UNKNOWN
                                : observed               ? DEFREC_POINT_OBSERVED
                                                         : DEFREC_POINT_EXTRAPOLATED;
    }
}

SurfaceBelief believe_at(const TemplateData& data, const VertexBelief& belief, const double xyz[3]) {
    constexpr double kGrowthOffSurface = 0.03;  // mm of error per mm from the surface
    const SurfaceGrid& grid = data.grid;
    SurfaceBelief at;
    at.expected_error = 100;
    if (!(xyz[2] > 0)) return at;
    const double u = data.camera.fx * xyz[0] / xyz[2] + data.camera.cx, v = data.camera.fy * xyz[1] / xyz[2] + data.camera.cy;
    if (!(std::abs(u) < 1e6 && std::abs(v) < 1e6)) return at;
    const int column = static_cast<int>(std::lround(u / grid.spacing)), row = static_cast<int>(std::lround(v / grid.spacing));
    // The nearest vertex within two grid steps; beyond, nothing is known of the surface there.
    int32_t nearest = -1;
    int best = 9;
    for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
            const int x = column + dx, y = row + dy;
            if (x < 0 || y < 0 || x >= grid.columns || y >= grid.rows || dx * dx + dy * dy >= best) continue;
            const int32_t vertex = grid.vertex[static_cast<size_t>(y * grid.columns + x)];
            if (vertex < 0) continue;
            nearest = vertex;
            best = dx * dx + dy * dy;
        }
    if (nearest < 0) return at;
    const size_t vertex = static_cast<size_t>(nearest);
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double difference = xyz[axis] - data.vertices[vertex].position[axis];
        squared += difference * difference;
    }
    const double step_mm = grid.spacing * data.vertices[vertex].position[2] / data.camera.fx;
    at.status = belief.status[vertex];
    at.expected_error = belief.expected_error[vertex] + kGrowthOffSurface * std::max(0.0, std::sqrt(squared) - 2 * step_mm);
    return at;
}

void fit_rigid_motion(const TemplateData& data, std::span<const defrec_surface_sample> samples, double motion[12]) {
    Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
    const size_t count = data.vertices.size();
    const auto source = [&](size_t i) { return Eigen::Map<const Eigen::Vector3f>(data.vertices[i].position).cast<double>().eval(); };
    const auto target = [&](size_t i) { return Eigen::Map<const Eigen::Vector3f>(samples[i].position).cast<double>().eval(); };
    for (size_t i = 0; i < count; ++i) {
        from += source(i);
        to += target(i);
    }
    from /= static_cast<double>(std::max<size_t>(1, count));
    to /= static_cast<double>(std::max<size_t>(1, count));
    Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
    for (size_t i = 0; i < count; ++i) correlation += (target(i) - to) * (source(i) - from).transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    const Eigen::Matrix3d rotation = svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
    const Eigen::Vector3d translation = to - rotation * from;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) motion[4 * row + column] = rotation(row, column);
        motion[4 * row + 3] = translation[row];
    }
}

}  // namespace defrec
