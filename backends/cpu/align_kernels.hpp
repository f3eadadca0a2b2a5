// What the files of the CPU's align share: one level's images, and the work on one patch from
// sampling to the refined position.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "backends/definition/align_math.hpp"
#include "backends/stages/align.hpp"

namespace defrec::cpu {

// The live image at the level that is searched. mask: nullptr where every pixel is usable, else 0
// where not.
struct AlignLevel {
    const uint8_t *gray, *mask;
    int32_t width, height;
    size_t stride, size;  // of both, bytes
};

constexpr size_t kAlignViewSlack = 2;  // bytes behind the last view that can be read

// A view of the template at twice the level's size, densely.
struct AlignView {
    const uint8_t* pixels;
    int32_t width, height;
};

constexpr int32_t kAlignRow = 16;  // int16 from row to row of a sampled patch
constexpr int32_t kAlignRows = 2 * kAlignMaxPatchRadius + 1;
constexpr int32_t kAlignWindowRow = 64;  // int16 from row to row of a live window
constexpr int32_t kAlignWindowRows = 2 * (kAlignMaxPatchRadius + kAlignMaxSearchRadius + 1) + 1;
constexpr int32_t kAlignScores =
    (2 * kAlignMaxSearchRadius + 1) * (kAlignMaxSearchRadius + 1);  // at most, at a time
constexpr int32_t kAlignLanes = 16;                                 // most that are used
constexpr int32_t kAlignFar = 1 << 12;                              // px

// Sums over the patch for displacements that are scored at a time, those of AlignSearch in its rows
// and then those round the best of them in rows of four.
using AlignSums = int32_t[kAlignScores + kAlignLanes];
// Round the predicted pixel; behind it what vectors read beyond its last row.
using AlignWindow = int16_t[(kAlignWindowRows + 1) * kAlignWindowRow];

// The memory of one patch's search.
struct AlignScratch {
    alignas(64) int16_t t[kAlignRows * kAlignRow], gx[kAlignRows * kAlignRow],
        gy[kAlignRows * kAlignRow];  // 0 beyond the patch
    alignas(64) int16_t high[kAlignRows * kAlignRow],
        low[kAlignRows * kAlignRow];  // t * t = 4096 high + low
    alignas(64) AlignWindow live;
    alignas(64) AlignWindow usable;       // 0 or 1; only where masked
    alignas(64) AlignWindow usable_live;  // live where usable, else 0; only where masked
    alignas(64) AlignSums i, ii, ti, n, t_sum, tt_high, tt_low;  // the last four only where masked
    bool masked;
    bool is_searched;         // all above is there
    int32_t full_tt, full_t;  // of the whole patch
};

// The displacements that are scored first: with both coordinates even or, in a search that is wide,
// both odd. They have places in rows of dx, as many in each row of dy.
struct AlignSearch {
    int32_t even, odd;   // the farthest; odd is -1 where none are scored
    int32_t top, step;   // the farthest dy, and from one to the next
    int32_t row_places;  // the last place of a row may be none's

    explicit constexpr AlignSearch(int32_t radius)
        : even(radius / 2 * 2),
          odd(radius > align::kEvenSearch ? (radius + 1) / 2 * 2 - 1 : -1),
          top(std::max(even, odd)),
          step(odd < 0 ? 2 : 1),
          row_places(top + 1) {}
    constexpr int32_t farthest(int32_t dy) const { return dy % 2 == 0 ? even : odd; }
    constexpr int32_t rows() const { return 2 * top / step + 1; }
    constexpr int32_t place(int32_t dx, int32_t dy) const {
        return (dy + top) / step * row_places + (dx + farthest(dy)) / 2;
    }
};

// Places row by row, for SIMD: of a patch's samples, px, and of the displacements that are scored
// first. Behind the last are kAlignLanes more: of samples the centre, of displacements kAlignFar,
// which none is.
struct AlignPlaces {
    HostVector<int32_t> sample_x, sample_y, shift_x, shift_y;
    // Usable flag, x and y of the pixels of a patch that is usable throughout, in rows of
    // kAlignRow; 0 beyond it.
    HostVector<int16_t> usable, x, y;
    align::TemplateSums sums;  // of it, those of n, x and y
    align::LightFits fits;

    AlignPlaces(const defrec_align_params& params, const Host& host);
};

// What one run's patches have in common.
struct AlignRun {
    const defrec_align_params* params;
    AlignLevel level;
    const AlignView* views;
    const float *inverse, *root;  // 1 / n and sqrt(n) at n - 1
    const AlignPlaces* places;
};

// The live pixel that matches best; where the refinement starts.
struct AlignPeak {
    int32_t x, y;                    // live image
    int32_t window_x, window_y;      // its place in the scratch's window
    int32_t fraction_x, fraction_y;  // of the predicted centre, 1/256 px
};

// Samples the patch into the scratch and searches it; false where it is not found.
bool align_search(const AlignRun& run, const AlignCentre& centre,
                  const defrec_patch_prediction& prediction, AlignScratch& scratch,
                  AlignPeak& peak);
// The score where it is predicted, after align_search; kUnscored where there is none.
int32_t align_predicted_score(const AlignRun& run, const defrec_patch_prediction& prediction,
                              AlignScratch& scratch);
// To a fraction of a pixel; result is zero unless found.
void align_refine(const AlignRun& run, const AlignScratch& scratch, const AlignPeak& peak,
                  defrec_patch_observation& result);

}  // namespace defrec::cpu
