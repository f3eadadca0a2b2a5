// A gray value between pixels is rounded down instead of to the nearest.
#include <algorithm>

#include "backends/stages/rectify.hpp"
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_rectify_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        const RectifyBuffers b = rectify_buffers(params(), in, out);
        for (size_t y = 0; b.map != nullptr && y < params().height; ++y)
            for (size_t x = 0; x < params().width; ++x) {
                const int32_t* from = b.map + 2 * (y * params().width + x);
                sample(b, from[0], from[1], b.gray[y * params().stride + x]);
            }
    }

  private:
    void sample(const RectifyBuffers& b, int32_t mx, int32_t my, uint8_t& result) const {
        const int32_t last_x = int32_t(params().source_width) - 1,
                      last_y = int32_t(params().source_height) - 1;
        if (mx < 0 || my < 0 || mx > last_x * kMapOne || my > last_y * kMapOne) return;
        const int32_t i = mx / kMapOne, a = mx % kMapOne, j = my / kMapOne, c = my % kMapOne;
        const auto row = [&](int32_t v) {
            v = std::min(v, last_y);
            return (kMapOne - a) * gray(b.source, i, v) +
                   a * gray(b.source, std::min(i + 1, last_x), v);
        };
        result = uint8_t(((kMapOne - c) * row(j) + c * row(j + 1)) >> 14);
    }
    int32_t gray(const uint8_t* source, int32_t x, int32_t y) const {
        const uint8_t* s = source + size_t(y) * params().source_stride +
                           size_t(x) * bytes_per_pixel(params().format);
        if (params().format == DEFREC_FORMAT_GRAY8) return s[0];
        const bool rgb = params().format == DEFREC_FORMAT_RGB8;
        return (77 * s[rgb ? 0 : 2] + 150 * s[1] + 29 * s[rgb ? 2 : 0] + 128) >> 8;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
