// Padding, inpainting and halving for stereo. Plain loops, compiled for each of Highway's targets.
#include <algorithm>
#include <cstring>

#include "backends/cpu/stereo_kernels.hpp"
#include "backends/stages/stereo.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/stereo_prepare.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {

void RepeatEnds(uint8_t* row, int width) {
    std::memset(row - kMargin, row[0], kMargin);
    std::memset(row + width, row[width - 1], kMargin);
}

void PadRow(const uint8_t* src, uint8_t* dst, int width) {
    std::memcpy(dst, src, size_t(width));
    RepeatEnds(dst, width);
}

void AddMasked(const uint8_t* HWY_RESTRICT gray, const uint8_t* HWY_RESTRICT mask, int begin,
               int end, int32_t* HWY_RESTRICT sums, int32_t* HWY_RESTRICT counts) {
    for (int x = begin; x < end; ++x) {
        const int usable = mask[x] != 0 ? 1 : 0;
        sums[x] += usable * gray[x];
        counts[x] += usable;
    }
}

void InpaintRow(Plane<const uint8_t> gray, Plane<const uint8_t> mask, int width, int height, int y,
                uint8_t* dst, int32_t* scratch) {
    const uint8_t* row = mask.row(y);
    const auto* found = static_cast<const uint8_t*>(std::memchr(row, 0, size_t(width)));
    if (found == nullptr) return;
    const int first = int(found - row);
    int last = width - 1;
    while (row[last] != 0) --last;
    const int begin = std::max(0, first - kInpaintRadius),
              end = std::min(width, last + kInpaintRadius + 1);
    int32_t *sums = scratch, *counts = scratch + width;
    std::fill(sums + begin, sums + end, 0);
    std::fill(counts + begin, counts + end, 0);
    for (int v = std::max(0, y - kInpaintRadius); v <= std::min(height - 1, y + kInpaintRadius);
         ++v)
        AddMasked(gray.row(v), mask.row(v), begin, end, sums, counts);
    // Sums over x < i, so that a window is a difference.
    int32_t *sums_before = scratch + 2 * width, *counts_before = scratch + 3 * width + 1;
    sums_before[begin] = counts_before[begin] = 0;
    for (int x = begin; x < end; ++x) {
        sums_before[x + 1] = sums_before[x] + sums[x];
        counts_before[x + 1] = counts_before[x] + counts[x];
    }
    for (int x = first; x <= last; ++x) {
        if (row[x] != 0) continue;
        const int from = std::max(begin, x - kInpaintRadius),
                  to = std::min(end, x + kInpaintRadius + 1);
        const int sum = sums_before[to] - sums_before[from],
                  count = counts_before[to] - counts_before[from];
        dst[x] = count == 0 ? 128 : uint8_t((2 * sum + count) / (2 * count));
    }
    RepeatEnds(dst, width);
}

void HalveRow(const uint8_t* HWY_RESTRICT upper, const uint8_t* HWY_RESTRICT lower,
              uint8_t* HWY_RESTRICT dst, int half_width) {
    for (int x = 0; x < half_width; ++x)
        dst[x] =
            uint8_t((upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1] + 2) >> 2);
    RepeatEnds(dst, half_width);
}

void HalveMaskRow(const uint8_t* HWY_RESTRICT upper, const uint8_t* HWY_RESTRICT lower,
                  uint8_t* HWY_RESTRICT dst, int half_width) {
    for (int x = 0; x < half_width; ++x) {
        const int usable = (upper[2 * x] != 0) & (upper[2 * x + 1] != 0) & (lower[2 * x] != 0) &
                           (lower[2 * x + 1] != 0);
        dst[x] = uint8_t(-usable);
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(PadRow);
HWY_EXPORT(InpaintRow);
HWY_EXPORT(HalveRow);
HWY_EXPORT(HalveMaskRow);

void pad_row(const uint8_t* src, uint8_t* dst, int width) {
    HWY_DYNAMIC_DISPATCH(PadRow)(src, dst, width);
}
void inpaint_row(Plane<const uint8_t> gray, Plane<const uint8_t> mask, int width, int height, int y,
                 uint8_t* dst, int32_t* scratch) {
    HWY_DYNAMIC_DISPATCH(InpaintRow)(gray, mask, width, height, y, dst, scratch);
}
void halve_row(const uint8_t* upper, const uint8_t* lower, uint8_t* dst, int half_width) {
    HWY_DYNAMIC_DISPATCH(HalveRow)(upper, lower, dst, half_width);
}
void halve_mask_row(const uint8_t* upper, const uint8_t* lower, uint8_t* dst, int half_width) {
    HWY_DYNAMIC_DISPATCH(HalveMaskRow)(upper, lower, dst, half_width);
}

}  // namespace defrec::cpu
#endif
