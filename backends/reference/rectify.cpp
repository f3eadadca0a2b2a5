// Stage rectify as plain code: gray, sampling through a map, mask. docs/stages/rectify.md.
#include "backends/stages/rectify.hpp"

#include <algorithm>

#include "backends/reference/stages.hpp"
#include "backends/shared/gray.hpp"

namespace defrec::reference {
namespace {

class Rectify final : public Stage {
  public:
    Rectify(const defrec_rectify_params& params, const Host& host)
        : p_(params),
          covered_(size_t{params.width} * params.height, HostAllocator<uint8_t>(host)),
          saturated_(covered_) {}

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const RectifyBuffers b = rectify_buffers(p_, in, out);
        for (int y = 0; y < int(p_.height); ++y)
            for (int x = 0; x < int(p_.width); ++x) sample(b, x, y);
        for (int y = 0; y < int(p_.height); ++y)
            for (int x = 0; x < int(p_.width); ++x)
                b.mask[size_t(y) * p_.stride + x] =
                    covered_[at(x, y)] && !near_highlight(x, y) ? 255 : 0;
    }

  private:
    size_t at(int x, int y) const { return size_t(y) * p_.width + x; }

    int source_gray(const uint8_t* source, int x, int y) const {
        const uint8_t* s =
            source + size_t(y) * p_.source_stride + size_t(x) * bytes_per_pixel(p_.format);
        if (p_.format == DEFREC_FORMAT_GRAY8) return s[0];
        const bool rgb = p_.format == DEFREC_FORMAT_RGB8;
        const int red = rgb ? s[0] : s[2], blue = rgb ? s[2] : s[0];
        return gray_of(red, s[1], blue);
    }

    void sample(const RectifyBuffers& b, int x, int y) {
        const int last_x = int(p_.source_width) - 1, last_y = int(p_.source_height) - 1;
        int32_t mx = x * kMapOne, my = y * kMapOne;
        if (b.map != nullptr) {
            mx = b.map[2 * at(x, y)];
            my = b.map[2 * at(x, y) + 1];
        }
        uint8_t& gray = b.gray[size_t(y) * p_.stride + x];
        if (mx < 0 || my < 0 || mx > last_x * kMapOne || my > last_y * kMapOne) {
            gray = 0;
            covered_[at(x, y)] = saturated_[at(x, y)] = 0;
            return;
        }
        const int i = mx >> 7, j = my >> 7, wx = mx & 127, wy = my & 127;
        const int i1 = std::min(i + 1, last_x), j1 = std::min(j + 1, last_y);
        const int top =
            (128 - wx) * source_gray(b.source, i, j) + wx * source_gray(b.source, i1, j);
        const int bottom =
            (128 - wx) * source_gray(b.source, i, j1) + wx * source_gray(b.source, i1, j1);
        gray = uint8_t(((128 - wy) * top + wy * bottom + 8192) >> 14);
        saturated_[at(x, y)] = gray >= p_.saturation;
        covered_[at(x, y)] = !ignored(b, i, j, i1, j1);
    }

    bool ignored(const RectifyBuffers& b, int i, int j, int i1, int j1) const {
        if (b.ignore == nullptr) return false;
        if (b.map == nullptr) return b.ignore[size_t(j) * p_.source_width + i] != 0;
        const uint8_t* upper = b.ignore + size_t(j) * p_.source_width;
        const uint8_t* lower = b.ignore + size_t(j1) * p_.source_width;
        return (upper[i] | upper[i1] | lower[i] | lower[i1]) != 0;
    }

    bool near_highlight(int x, int y) const {
        const int r = int(p_.highlight_radius), w = int(p_.width), h = int(p_.height);
        for (int v = std::max(0, y - r); v <= std::min(h - 1, y + r); ++v)
            for (int u = std::max(0, x - r); u <= std::min(w - 1, x + r); ++u)
                if (saturated_[at(u, v)]) return true;
        return false;
    }

    defrec_rectify_params p_;
    HostVector<uint8_t> covered_, saturated_;
};

}  // namespace

std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, const Host& host) {
    check_params(params);
    return std::make_unique<Rectify>(params, host);
}

}  // namespace defrec::reference
