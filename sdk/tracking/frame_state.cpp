#include "sdk/tracking/frame_state.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "backends/shared/motion.hpp"
#include "sdk/base/word_hash.hpp"

namespace defrec {
namespace {

// Sums over gray values, a batch at a time so that the compiler makes vectors of them.
class GraySums {
  public:
    using Batch = std::array<uint8_t, 256>;
    // The first `filled` of them.
    void add(Batch& batch, size_t filled) {
        std::fill(batch.begin() + static_cast<std::ptrdiff_t>(filled), batch.end(), uint8_t{0});
        uint32_t sum = 0, squares = 0, saturated = 0;
        for (const uint32_t value : batch) {
            sum += value;
            squares += value * value;
            saturated += value >= 250;
        }
        for (size_t i = 0; i < batch.size(); i += sizeof(uint64_t)) hash_.add(&batch[i]);
        sum_ += sum;
        squares_ += squares;
        saturated_ += saturated;
        count_ += filled;
    }
    ImageStatistics statistics() const {
        ImageStatistics result;
        if (count_ == 0) return result;
        const double n = static_cast<double>(count_);
        result.mean = static_cast<double>(sum_) / n;
        result.deviation =
            std::sqrt(std::max(0.0, static_cast<double>(squares_) / n - result.mean * result.mean));
        result.saturated_share = static_cast<double>(saturated_) / n;
        result.hash = hash_.value();
        return result;
    }

  private:
    uint64_t sum_ = 0, squares_ = 0, saturated_ = 0, count_ = 0;
    WordHash hash_;
};

// See ImageStatistics::row_ratio; 0 where rows differ by less than a rounding error.
double row_ratio(const uint8_t* gray, uint32_t width, uint32_t height) {
    constexpr uint32_t kColumns = 4, kMinRows = 4;
    constexpr uint64_t kLeastDifference = 4;  // of rows two apart, 1/16 gray level
    // About 64 rows, each a first one of a pair.
    const uint32_t step = std::max(kMinRows, height / 64 / kMinRows * kMinRows);
    uint64_t beside = 0, two_apart = 0, count = 0;
    for (uint32_t y = 2; y + 2 < height; y += step) {
        const uint8_t* row = gray + static_cast<size_t>(y) * width;
        for (uint32_t x = kColumns / 2; x < width; x += kColumns, ++count) {
            beside += static_cast<uint32_t>(std::abs(row[x] - row[x + width]));
            two_apart += static_cast<uint32_t>(std::abs(row[x] - row[x + 2 * size_t{width}]));
        }
    }
    if (16 * two_apart <= kLeastDifference * count) return 0;
    return static_cast<double>(beside) / static_cast<double>(two_apart);
}

}  // namespace

ImageStatistics image_statistics(const uint8_t* gray, uint32_t width, uint32_t height,
                                 const int32_t* map) {
    constexpr uint32_t kStep = 4;
    GraySums sums;
    for (uint32_t y = kStep / 2; y < height; y += kStep) {
        const uint8_t* row = gray + static_cast<size_t>(y) * width;
        const int32_t* row_map = map != nullptr ? map + 2 * size_t{y} * width : nullptr;
        for (uint32_t x = kStep / 2; x < width;) {
            GraySums::Batch batch;
            size_t filled = 0;
            if (row_map == nullptr) {
                const size_t left = (width - x + kStep - 1) / kStep;
                for (const size_t end = std::min(batch.size(), left); filled < end; x += kStep)
                    batch[filled++] = row[x];
            } else {
                for (; x < width && filled < batch.size(); x += kStep) {
                    batch[filled] = row[x];
                    filled += row_map[2 * x] != INT32_MIN;
                }
            }
            sums.add(batch, filled);
        }
    }
    ImageStatistics statistics = sums.statistics();
    if (map == nullptr) statistics.row_ratio = row_ratio(gray, width, height);
    return statistics;
}

void measure_patches(const TemplateData& data, const FrameOutput& output, size_t first,
                     std::span<double> patch_px2) {
    const defrec_camera& camera = data.camera;
    std::fill(patch_px2.begin(), patch_px2.end(), std::numeric_limits<double>::quiet_NaN());
    for (size_t i = first; i < first + patch_px2.size(); ++i) {
        const defrec_patch_observation& observation = output.observations[i];
        if (output.predictions[i].valid == 0 || observation.valid == 0) continue;
        const defrec_patch& patch = data.patches[i];
        const Vec3<double> p = apply(blend<double>(output.motions.data(), patch.node, patch.weight),
                                     load3<double>(patch.position));
        if (!(p.z > 0)) continue;
        const double du = camera.fx * p.x / p.z + camera.cx - observation.u / 256.0;
        const double dv = camera.fy * p.y / p.z + camera.cy - observation.v / 256.0;
        patch_px2[i - first] = du * du + dv * dv;
    }
}

VertexEvidence weigh_vertices(std::span<const defrec_surface_sample> samples) {
    VertexEvidence evidence;
    for (const defrec_surface_sample& sample : samples) {
        evidence.inside += sample.observation != DEFREC_OUTSIDE;
        if (sample.observation == DEFREC_OBSERVED) {
            ++evidence.observed;
            evidence.residuals += std::abs(sample.residual);
        }
        evidence.occluded += sample.observation == DEFREC_OCCLUDED;
        evidence.without_depth += sample.observation == DEFREC_NO_DEPTH;
    }
    return evidence;
}

Evidence weigh_evidence(const FrameOutput& output, std::span<const VertexEvidence> runs,
                        std::span<const double> patch_px2) {
    Evidence evidence;
    double residuals = 0;
    for (const VertexEvidence& run : runs) {
        evidence.vertices_inside += run.inside;
        evidence.vertices_observed += run.observed;
        evidence.vertices_occluded += run.occluded;
        evidence.vertices_without_depth += run.without_depth;
        residuals += run.residuals;
    }
    if (evidence.vertices_observed > 0)
        evidence.mean_residual_mm = residuals / evidence.vertices_observed;

    double squares = 0;
    for (size_t i = 0; i < patch_px2.size(); ++i) {
        evidence.patches_expected += output.predictions[i].valid != 0;
        if (!is_confirmed(patch_px2[i])) continue;
        ++evidence.patches_confirmed;
        squares += patch_px2[i];
    }
    if (evidence.patches_confirmed > 0)
        evidence.patch_rms_px = std::sqrt(squares / evidence.patches_confirmed);
    evidence.features = output.summary->features;
    evidence.matches = static_cast<uint32_t>(std::max(0, output.summary->ransac.valid_matches));
    evidence.inliers = static_cast<uint32_t>(std::max(0, output.summary->ransac.inliers));
    return evidence;
}

Verdict classify(const TemplateData& data, const Evidence& evidence, bool was_found,
                 bool uses_depth) {
    Verdict verdict;
    // Of what an image can show: tissue that joined lies beside the first view.
    const auto inside_share =
        static_cast<double>(evidence.vertices_inside) /
        static_cast<double>(std::max<uint64_t>(1, data.first_counts().vertices));
    const double confirmed = evidence.confirmed_share(), observed = evidence.observed_share();
    // A wrong surface confirms one patch in fifty by chance, a right one in heavy smoke one in ten.
    // What was followed up to here needs less evidence than what is said to be found again.
    const uint32_t min_patches = was_found ? 30 : 60;
    const double min_share = was_found ? 0.05 : 0.12;
    // An image as rich in features as the template's that shows none of them shows other tissue.
    // Its patches still agree by chance, more of them where texture and depth are alike.
    const bool is_other_tissue = 2 * size_t{evidence.features} >= data.landmarks.size() &&
                                 !data.landmarks.empty() && evidence.inliers < 10 &&
                                 confirmed < 0.12;
    const bool patches_agree = evidence.patches_confirmed >= min_patches && confirmed >= min_share;
    const bool features_agree =
        evidence.patches_confirmed >= 20 && confirmed >= min_share && evidence.inliers >= 15;
    verdict.found = !is_other_tissue && (patches_agree || features_agree) &&
                    (observed >= 0.1 || !uses_depth) && inside_share >= 0.05;

    if (evidence.confirms_few()) verdict.reasons |= DEFREC_REASON_LOW_CONTRAST;
    if (evidence.inliers < 10) verdict.reasons |= DEFREC_REASON_FEW_MATCHES;
    const double inside = std::max(1u, evidence.vertices_inside);
    if (evidence.vertices_occluded / inside > 0.25) verdict.reasons |= DEFREC_REASON_OCCLUDED;
    if (uses_depth && evidence.vertices_without_depth / inside > 0.5)
        verdict.reasons |= DEFREC_REASON_NO_DEPTH;
    if (evidence.mean_residual_mm > 1.0) verdict.reasons |= DEFREC_REASON_LARGE_RESIDUAL;
    if (inside_share < 0.5) verdict.reasons |= DEFREC_REASON_OUT_OF_VIEW;
    verdict.degraded = (verdict.reasons & ~static_cast<uint32_t>(DEFREC_REASON_FEW_MATCHES)) != 0;
    return verdict;
}

}  // namespace defrec
