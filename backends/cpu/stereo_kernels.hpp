// The sub-stages of stereo on rows, vectorised and dispatched at run time. Not the stage: that is
// stereo.cpp. docs/stages/stereo.md defines each; the numbers are its sections.
#pragma once
#include <cstddef>
#include <cstdint>

#include "backends/stages/stereo.hpp"

namespace defrec::cpu {

// Elements before and after each row of a plane, so that vectors may reach over the ends.
constexpr int kMargin = 64;

// Rows of an image with margins; data is the first pixel.
template <class T>
struct Plane {
    T* data;
    ptrdiff_t stride;
    T* row(int y) const { return data + y * stride; }
};

// 1: a row's copy with its ends repeated through the margins.
void pad_row(const uint8_t* src, uint8_t* dst, int width);
// 1: dst row y where mask is 0 becomes the mean of the usable neighbours in gray. scratch: 4 *
// width + 2 int32.
void inpaint_row(Plane<const uint8_t> gray, Plane<const uint8_t> mask, int width, int height, int y,
                 uint8_t* dst, int32_t* scratch);
// 2: one row of the half image, margins included, from two rows.
void halve_row(const uint8_t* upper, const uint8_t* lower, uint8_t* dst, int half_width);
void halve_mask_row(const uint8_t* upper, const uint8_t* lower, uint8_t* dst, int half_width);

// 3, 4: the search and its checks.
struct SearchJob {
    StereoConstants c;
    Plane<const uint8_t> left, right, left_mask, right_mask;
    int32_t *left_keys, *right_keys;  // without margins; may be nullptr
    Plane<int16_t> checked;           // of samples
};
size_t search_scratch_ints(const StereoConstants& c);
// Rows row0 .. row1 - 1 of samples. scratch: search_scratch_ints, cache-line aligned, any contents.
void search_rows(const SearchJob& job, int row0, int row1, int32_t* scratch);

// Fields of samples' disparities, whose sizes are in samples, have kNoDisparity in their margins,
// and the functions keep it so.
// 5
void supported_row(Plane<const int16_t> field, int width, int height, int y,
                   const StereoConstants& c, int16_t* dst);
// 6, 12: along rows, and along columns as soon as the rows of a window are there; the next pass
// takes the rows as they come.
struct SmoothJob {
    Plane<const int16_t> from;
    Plane<int16_t> to;  // another one
    int width, height, radius, range, passes;
    const int16_t* none_row;
};
constexpr int kMaxSmoothRadius = 2;
constexpr int kSmoothRing = 2 * kMaxSmoothRadius + 1;
constexpr size_t smooth_scratch_row(int width) {
    return (size_t(width) + kMargin - 1) / kMargin * kMargin + 2 * kMargin;
}
constexpr size_t smooth_scratch(int width, int passes) {
    return size_t(passes) * (kSmoothRing + 1) * smooth_scratch_row(width);
}
// Rows y0 .. y1 - 1. scratch: smooth_scratch.
void smooth_rows(const SmoothJob& job, int y0, int y1, int16_t* scratch);
// 6: one row of the next coarser field, and the filled row from it.
void coarser_row(const int16_t* upper, const int16_t* lower, int width, int16_t* dst);
void fill_row(int16_t* row, int width, const int16_t* coarse, const int16_t* coarse2,
              int coarse_width);
// 7: dst[x] = kSettled, kOpen or kDoubtful, the last one twice, for a row of samples of half
// resolution. extent: the field's least and largest values along the columns, 2 * (half_samples_x +
// 2 * kMargin) int16.
void standing_row(Plane<const int16_t> supported, Plane<const int16_t> dense, int y,
                  const StereoConstants& c, int16_t* extent, uint8_t* dst);
// 8: row y of the field between samples. Writes up to 63 elements beyond the row.
void between_row(Plane<const int16_t> samples, int samples_x, int samples_y, int width, int y,
                 int16_t* dst);
// 9: row y of the hypothesis at full resolution. Writes up to 63 elements beyond the row.
void hypothesis_row(Plane<const int16_t> samples, int samples_x, int samples_y, int width, int y,
                    int16_t* dst);

// 8, 10: refinement, and at full resolution the classification.
struct RefineJob {
    StereoConstants c;
    Plane<const uint8_t> left, right;
    int width, height, radius;
    Plane<const int16_t> hypothesis;  // of all pixels, none without a disparity
    Plane<int16_t> result;            // of samples: refined field, or with classify the evidence
    bool classify;
    Plane<const uint8_t> left_mask;  // without margins; data may be nullptr
    Plane<const uint8_t> right_mask;
    Plane<const uint8_t> standing;  // of samples of half resolution
    Plane<uint8_t> confidence;      // of samples; data may be nullptr
    int16_t *refined, *score;       // of samples, without margins; may be nullptr
};
constexpr int kRefineTile = 256;  // most columns of a tile, which begins at a multiple of as many
// Columns x0 .. x1 - 1 of rows row0 .. row1 - 1 of samples.
void refine_tile(const RefineJob& job, int x0, int x1, int row0, int row1);

// 10: evidence rows y0 .. y1 - 1 with speckles dropped; their confidence is cleared where it is
// given.
void drop_speckles_rows(Plane<const int16_t> evidence, int y0, int y1, const StereoConstants& c,
                        Plane<int16_t> dst, Plane<uint8_t> confidence);
// 11; hypothesis: of all pixels
void fill_small_rows(Plane<const int16_t> evidence, Plane<const int16_t> hypothesis, int y0, int y1,
                     const StereoConstants& c, Plane<int16_t> dst, Plane<uint8_t> confidence);
// 13: row y of the result.
void result_row(Plane<const int16_t> samples, int samples_y, int width, int range, int y,
                int16_t* dst);

}  // namespace defrec::cpu
