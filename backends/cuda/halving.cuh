// Pixels of images and masks that are halved (docs/stages/align.md, section 2, and orb.md, section
// 1), from the whole ones.
#pragma once
#include "backends/cuda/device/device_code.hpp"

namespace defrec::cuda {

// A pixel of the image; of a mask 0 or not 0.
template <int kHalvings, bool kMask>
__device__ int32_t halved(const uint8_t* image, int32_t stride, int32_t x, int32_t y) {
    if constexpr (kHalvings == 0) {
        return __ldg(image + int64_t{y} * stride + x);
    } else {
        const auto at = [&](int32_t dx, int32_t dy) {
            return halved<kHalvings - 1, kMask>(image, stride, 2 * x + dx, 2 * y + dy);
        };
        const int32_t a = at(0, 0), b = at(1, 0), c = at(0, 1), d = at(1, 1);
        return kMask ? min(min(a, b), min(c, d)) : (a + b + c + d + 2) >> 2;
    }
}

}  // namespace defrec::cuda
