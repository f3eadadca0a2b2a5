#include "sdk/frame_state.hpp"

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

}  // namespace defrec
