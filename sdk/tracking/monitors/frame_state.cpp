#include "sdk/tracking/monitors/frame_state.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "backends/shared/motion.hpp"
#include "sdk/base/util/word_hash.hpp"
#include "sdk/tracking/decisions/settings.hpp"

namespace defrec {
namespace {

using decisions::Images;

constexpr uint32_t kStep = Images::kPixelStep;

// The first row from that one on of those that are a step apart, of which this is the first.
uint32_t align_row(uint32_t from, uint32_t first, uint32_t step) {
    return from <= first ? first : first + (from - first + step - 1) / step * step;
}

using Batch = std::array<uint8_t, 256>;

// A batch at a time so that the compiler makes vectors of them. The first `filled` count.
void add_batch(Batch& batch, size_t filled, GraySums& sums, WordHash& hash) {
    std::fill(batch.begin() + static_cast<std::ptrdiff_t>(filled), batch.end(), uint8_t{0});
    uint32_t sum = 0, squares = 0, saturated = 0;
    for (const uint32_t value : batch) {
        sum += value;
        squares += value * value;
        saturated += value >= Images::kSaturatedFrom;
    }
    for (size_t i = 0; i < batch.size(); i += sizeof(uint64_t)) hash.add(&batch[i]);
    sums.sum += sum;
    sums.squares += squares;
    sums.saturated += saturated;
    sums.count += filled;
}

void add_row(const uint8_t* row, const int32_t* row_map, uint32_t width, GraySums& sums,
             WordHash& hash) {
    for (uint32_t x = kStep / 2; x < width;) {
        Batch batch;
        size_t filled = 0;
        if (row_map == nullptr) {
            const uint8_t* from = row + x;
            filled = std::min<size_t>(batch.size(), (width - x + kStep - 1) / kStep);
            for (size_t i = 0; i < filled; ++i) batch[i] = from[kStep * i];
            x += kStep * static_cast<uint32_t>(filled);
        } else {
            for (; x < width && filled < batch.size(); x += kStep) {
                batch[filled] = row[x];
                filled += row_map[2 * x] != INT32_MIN;
            }
        }
        add_batch(batch, filled, sums, hash);
    }
}

void add_differences(const uint8_t* gray, uint32_t width, uint32_t height, RowRange rows,
                     GraySums& sums) {
    const uint32_t step = std::max(kStep, height / Images::kRowPairs / kStep * kStep);
    const uint32_t columns = (width + kStep / 2 - 1) / kStep;
    for (uint32_t y = align_row(rows.first, kStep / 2, step); y < rows.last && y + 2 < height;
         y += step) {
        const uint8_t* row = gray + static_cast<size_t>(y) * width + kStep / 2;
        const uint8_t *next = row + width, *second = next + width;
        uint32_t beside = 0, two_apart = 0;
        for (size_t i = 0; i < kStep * size_t{columns}; i += kStep) {
            beside += static_cast<uint32_t>(std::abs(row[i] - next[i]));
            two_apart += static_cast<uint32_t>(std::abs(row[i] - second[i]));
        }
        sums.beside += beside;
        sums.two_apart += two_apart;
        sums.differences += columns;
    }
}

// See ImageStatistics::row_ratio; 0 where rows differ by less than a rounding error.
double row_ratio(const GraySums& sums) {
    if (16 * sums.two_apart <= Images::kMinRowDifference * sums.differences) return 0;
    return static_cast<double>(sums.beside) / static_cast<double>(sums.two_apart);
}

}  // namespace

GraySums sum_gray(const uint8_t* gray, uint32_t width, uint32_t height, RowRange rows,
                  const int32_t* map) {
    GraySums sums;
    WordHash hash;
    for (uint32_t y = align_row(rows.first, kStep / 2, kStep); y < rows.last; y += kStep)
        add_row(gray + static_cast<size_t>(y) * width,
                map != nullptr ? map + 2 * size_t{y} * width : nullptr, width, sums, hash);
    sums.hash = hash.value();
    if (map == nullptr) add_differences(gray, width, height, rows, sums);
    return sums;
}

ImageStatistics image_statistics(std::span<const GraySums> parts) {
    GraySums all;
    WordHash hash;
    for (const GraySums& part : parts) {
        all.count += part.count;
        all.sum += part.sum;
        all.squares += part.squares;
        all.saturated += part.saturated;
        all.beside += part.beside;
        all.two_apart += part.two_apart;
        all.differences += part.differences;
        hash.add(part.hash);
    }
    ImageStatistics result;
    result.row_ratio = row_ratio(all);
    if (all.count == 0) return result;
    const double n = static_cast<double>(all.count);
    result.mean = static_cast<double>(all.sum) / n;
    result.deviation =
        std::sqrt(std::max(0.0, static_cast<double>(all.squares) / n - result.mean * result.mean));
    result.saturated_share = static_cast<double>(all.saturated) / n;
    result.hash = hash.value();
    return result;
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

uint32_t least_features(const TemplateData& data, uint32_t max_features) {
    constexpr auto kShare = decisions::FrameFound::kMoreThanNoise;
    return data.is_faint() ? kShare.numerator * max_features / kShare.denominator : 0;
}

FrameQuality classify(const TemplateData& data, const Evidence& evidence,
                      const TrackerSettings& settings, bool was_found, bool uses_depth) {
    FrameQuality quality;
    // Share of what an image can show: tissue that joined lies beside the first view.
    const auto inside_share =
        static_cast<double>(evidence.vertices_inside) /
        static_cast<double>(std::max<uint64_t>(1, data.first_counts().vertices));
    const double confirmed = evidence.confirmed_share(), observed = evidence.observed_share();
    using decisions::FrameFound;
    const uint32_t min_patches = FrameFound::kMinPatches.after(was_found);
    const double min_share = FrameFound::kMinPatchShare.after(was_found);
    // An image as rich in features as the template's that shows none of them shows other tissue.
    const bool has_few_matches = evidence.inliers < FrameFound::kFewMatches;
    const bool is_rich = FrameFound::kOtherTissueFeatures.denominator * evidence.features >=
                             FrameFound::kOtherTissueFeatures.numerator * data.landmarks.size() &&
                         !data.landmarks.empty() &&
                         evidence.features >= least_features(data, settings.max_features);
    const bool is_other_tissue =
        is_rich && has_few_matches && confirmed < FrameFound::kOtherTissueShare;
    const bool patches_agree = evidence.patches_confirmed >= min_patches && confirmed >= min_share;
    const bool features_agree = evidence.patches_confirmed >= FrameFound::kMinPatchesWithMatches &&
                                confirmed >= min_share &&
                                evidence.inliers >= FrameFound::kMinMatches;
    quality.found = !is_other_tissue && (patches_agree || features_agree) &&
                    (observed >= FrameFound::kMinDepthShare.after(was_found) || !uses_depth) &&
                    inside_share >= FrameFound::kMinInsideShare;

    // Neither smoke nor blur leave so many features: the surface is not where it is looked for.
    const bool is_elsewhere = is_rich && !quality.found;
    const double inside = std::max(1u, evidence.vertices_inside),
                 occluded = evidence.vertices_occluded / inside,
                 without_depth = evidence.vertices_without_depth / inside;
    // Instruments nearer than the search range, and blood without texture, have no depth.
    const bool is_covered = is_rich && quality.found && uses_depth && evidence.confirms_few() &&
                            confirmed >= decisions::Reasons::kCoveredConfirmed * observed &&
                            occluded + without_depth > settings.occluded_share;
    if (evidence.confirms_few() && !is_elsewhere && !is_covered)
        quality.add(DEFREC_REASON_LOW_CONTRAST);
    if (has_few_matches) quality.add(DEFREC_REASON_FEW_MATCHES);
    if (is_covered || occluded > settings.occluded_share) quality.add(DEFREC_REASON_OCCLUDED);
    if (uses_depth && !is_covered && without_depth > settings.no_depth_share)
        quality.add(DEFREC_REASON_NO_DEPTH);
    if (evidence.mean_residual_mm > settings.large_residual)
        quality.add(DEFREC_REASON_LARGE_RESIDUAL);
    if (quality.found && evidence.vertices_refuted / inside > settings.contradicted_share)
        quality.add(DEFREC_REASON_CONTRADICTED);
    if (inside_share < settings.out_of_view_share) quality.add(DEFREC_REASON_OUT_OF_VIEW);
    return quality;
}

}  // namespace defrec
