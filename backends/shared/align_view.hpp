// How align stores the template's views: at twice the size, so that bilinear sampling shifts no
// detail. Done once per template.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::align {

// out: (2 width) x (2 height), densely. Pixel (2x, 2y) is (x, y); those between by the 6-tap
// half-pixel filter (1 -5 20 20 -5 1) / 32, along rows first, rounded and limited to 0 .. 255 each
// time; borders repeat.
inline void double_size(const uint8_t* in, int32_t width, int32_t height, size_t stride,
                        uint8_t* out) {
    const auto filter = [](auto at) {
        return uint8_t(std::clamp(
            (at(-2) - 5 * at(-1) + 20 * at(0) + 20 * at(1) - 5 * at(2) + at(3) + 16) >> 5, 0, 255));
    };
    const size_t out_stride = size_t(2 * width);
    for (int32_t y = 0; y < height; ++y) {
        const uint8_t* row = in + size_t(y) * stride;
        uint8_t* to = out + size_t(2 * y) * out_stride;
        for (int32_t x = 0; x < width; ++x) {
            to[2 * x] = row[x];
            to[2 * x + 1] =
                filter([&](int32_t k) { return int32_t(row[std::clamp(x + k, 0, width - 1)]); });
        }
    }
    for (int32_t y = 0; y < height; ++y)
        for (size_t x = 0; x < out_stride; ++x)
            out[size_t(2 * y + 1) * out_stride + x] = filter([&](int32_t k) {
                return int32_t(out[size_t(2 * std::clamp(y + k, 0, height - 1)) * out_stride + x]);
            });
}

// A view at the level, doubled, after those already in `out`.
inline void add_view(const defrec_align_params& params, const uint8_t* pixels,
                     std::vector<uint8_t>& out) {
    size_t width = params.width, height = params.height, stride = params.stride;
    std::vector<uint8_t> level;
    for (uint32_t l = 0; l < params.level; ++l) {
        std::vector<uint8_t> half((width / 2) * (height / 2));
        for (size_t y = 0; y < height / 2; ++y)
            for (size_t x = 0; x < width / 2; ++x) {
                const uint8_t *upper = pixels + 2 * y * stride + 2 * x, *lower = upper + stride;
                half[y * (width / 2) + x] =
                    uint8_t((upper[0] + upper[1] + lower[0] + lower[1] + 2) >> 2);
            }
        level.swap(half);
        pixels = level.data();
        stride = width /= 2;
        height /= 2;
    }
    out.resize(out.size() + 4 * width * height);
    double_size(pixels, int32_t(width), int32_t(height), stride,
                out.data() + out.size() - 4 * width * height);
}

}  // namespace defrec::align
