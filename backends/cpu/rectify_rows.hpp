// The rows that stage rectify works on, vectorised and dispatched at run time. Not the stage: that
// is rectify.cpp.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec::cpu {

// dst[0..n) = gray of n pixels in a DEFREC_FORMAT_*.
void gray_row(uint32_t format, const uint8_t* src, uint8_t* dst, size_t n);

// A source image that sampling reads: one column and one row are repeated past the last, and 4
// bytes follow the end.
struct PaddedImage {
    const uint8_t* pixels;
    int32_t stride;
};

struct PaddedSource {
    PaddedImage gray, ignore;  // ignore may have pixels = nullptr
    int32_t width, height;
};

// Samples n pixels at map (x, y pairs, 1/128 px) from the source; mask[i] = 255 inside, 0 outside
// or where ignore is nonzero at one of the four taps.
void sample_row(const PaddedSource& source, const int32_t* map, uint8_t* dst, uint8_t* mask,
                size_t n);

// mask[i] = ignore[i] ? 0 : 255.
void ignore_row(const uint8_t* ignore, uint8_t* mask, size_t n);

uint8_t row_maximum(const uint8_t* row, size_t n);

// Clears mask[i] where the largest of the rows' values within radius of i reaches threshold.
// scratch: n + 2 * radius + 64 bytes.
void clear_near_highlights(const uint8_t* const* rows, size_t row_count, size_t n, int radius,
                           uint8_t threshold, uint8_t* scratch, uint8_t* mask);

}  // namespace defrec::cpu
