// How align stores the template's views: at twice the size, so that bilinear sampling shifts no detail. Done
// once per template.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace defrec::align {

// out: (2 width) x (2 height), densely. Pixel (2x, 2y) is (x, y); those between by the 6-tap half-pixel
// filter (1 -5 20 20 -5 1) / 32, along rows first, rounded and limited to 0 .. 255 each time; borders repeat.
inline void double_size(const uint8_t* in, int32_t width, int32_t height, size_t stride, uint8_t* out) {
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
            to[2 * x + 1] = filter([&](int32_t k) { return int32_t(row[std::clamp(x + k, 0, width - 1)]); });
        }
    }
    for (int32_t y = 0; y < height; ++y)
        for (size_t x = 0; x < out_stride; ++x)
            out[size_t(2 * y + 1) * out_stride + x] = filter([&](int32_t k) {
                return int32_t(out[size_t(2 * std::clamp(y + k, 0, height - 1)) * out_stride + x]);
            });
}

}  // namespace defrec::align
