// What one frame's evidence means: its state, the reasons, and for each vertex what to believe and
// how far. Pure functions of the evidence; the tracker holds the memory.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/contract/enumerations.hpp"
#include "sdk/tracking/decisions/images.hpp"
#include "sdk/tracking/decisions/states.hpp"
#include "sdk/tracking/frame/frame_output.hpp"
#include "sdk/tracking/frame/tracker_settings.hpp"

namespace defrec {

// Statistics of an image, from a part of its pixels.
struct ImageStatistics {
    double mean = 0;             // gray levels
    double deviation = 0;        // standard deviation, gray levels
    double saturated_share = 0;  // of the pixels
    uint64_t hash = 0;           // of the pixels looked at
    // Difference of rows beside each other over that of rows two apart, means of the absolute
    // values: large where every other row is of another time. 0: not known.
    double row_ratio = 0;
    double frozen = 0;  // of the blocks with texture, those that are as in the frame before
    bool dark() const { return mean < decisions::Images::kDark; }
    bool saturated() const { return saturated_share > decisions::Images::kSaturatedShare; }
    bool interlaced() const { return row_ratio > decisions::Images::kInterlacedRatio; }
};
// Rows of an image from the first up to the one before the last.
struct RowRange {
    uint32_t first, last;
};
// Sums over pixels of some rows.
struct GraySums {
    uint64_t count = 0, sum = 0, squares = 0, saturated = 0;
    uint64_t hash = 0;
    // Absolute differences of rows beside each other and two apart, and how many; see row_ratio.
    uint64_t beside = 0, two_apart = 0, differences = 0;
};
// gray: tight rows of width bytes. map: of a rectified image, the rig's, for what the camera did
// not see is not looked at, and its rows are no longer the camera's; may be nullptr.
GraySums sum_gray(const uint8_t* gray, uint32_t width, uint32_t height, RowRange rows,
                  const int32_t* map = nullptr);
// parts: that together are the image, in their order. The hash is of these parts.
ImageStatistics image_statistics(std::span<const GraySums> parts);

struct Evidence {
    uint32_t vertices_inside = 0;  // in the image
    uint32_t vertices_observed = 0;
    uint32_t vertices_occluded = 0;
    uint32_t vertices_without_depth = 0;
    uint32_t vertices_refuted = 0;   // PhotometricEvidence
    double mean_residual_mm = 0;     // of vertices with live depth that agrees, absolute
    uint32_t patches_expected = 0;   // predicted inside the image
    uint32_t patches_confirmed = 0;  // found where the deformed surface has them
    double patch_rms_px = 0;         // of the confirmed
    uint32_t features = 0, matches = 0, inliers = 0;

    double observed_share() const {
        return vertices_inside > 0 ? static_cast<double>(vertices_observed) / vertices_inside : 0;
    }
    double confirmed_share() const {
        return patches_expected > 0 ? static_cast<double>(patches_confirmed) / patches_expected : 0;
    }
    bool confirms_few() const { return confirmed_share() < decisions::WideSearch::kFewConfirmed; }
};
// Sums over a run of vertices.
struct VertexEvidence {
    uint32_t inside = 0, observed = 0, occluded = 0, without_depth = 0;
    double residuals = 0;  // mm, absolute, of those observed
};
VertexEvidence weigh_vertices(std::span<const defrec_surface_sample> samples);
// Per patch from first on, one for each value: squared distance, px^2, from where the deformed
// surface has it to where it was found; NaN where it was not found or not expected.
void measure_patches(const TemplateData& data, const FrameOutput& output, size_t first,
                     std::span<double> patch_px2);
// Whether such a value is confirmed: its patch was found where the deformed surface has it.
inline bool is_confirmed(double patch_px2) {
    constexpr double kDistance = decisions::FrameFound::kConfirmedDistance;
    return patch_px2 <= kDistance * kDistance;
}
// runs: of all vertices, in their order.
Evidence weigh_evidence(const FrameOutput& output, std::span<const VertexEvidence> runs,
                        std::span<const double> patch_px2);

struct FrameQuality {
    bool found = false;  // the surface was followed into this frame
    bool degraded = false;
    uint32_t reasons = 0;  // DEFREC_REASON_*

    // With their effect by the header.
    void add(uint32_t more_reasons) {
        reasons |= more_reasons;
        degraded |= (more_reasons & kDegradingReasons) != 0;
    }
};
// From how many features on, of all that are looked for, a frame shows more than the noise of the
// template's faint texture; 0 where that is not faint.
uint32_t least_features(const TemplateData& data, uint32_t max_features);
// was_found: the surface was followed into the frame before. uses_depth: else it was followed by
// the left image alone.
FrameQuality classify(const TemplateData& data, const Evidence& evidence,
                      const TrackerSettings& settings, bool was_found, bool uses_depth = true);

}  // namespace defrec
