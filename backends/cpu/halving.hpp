// Halving images and masks, for every instruction set and chosen at run time.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec::cpu {

// Rows [first, last) of an image of half the size: the rounded mean of each 2x2 block, or 1 where
// all four are not 0.
void halve_gray(const uint8_t* in, size_t in_stride, uint8_t* out, size_t out_stride,
                int32_t out_width, int32_t first, int32_t last);
void halve_mask(const uint8_t* in, size_t in_stride, uint8_t* out, size_t out_stride,
                int32_t out_width, int32_t first, int32_t last);

}  // namespace defrec::cpu
