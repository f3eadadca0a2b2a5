// Stage orb, section 1 (docs/stages/orb.md): a block makes its part of up to four levels, each from
// the one before in shared memory. Five pixels become four, so a part needs nothing round it, but
// up to 3 px that its neighbours make too.
#include <algorithm>

#include "backends/cuda/halving.cuh"
#include "backends/cuda/orb_steps.hpp"

namespace defrec::cuda {
namespace {

constexpr int kLevelsAtOnce = 4;
constexpr int kTile = 16;     // px of the last of them that a block makes
constexpr int kMaxSide = 40;  // of a block's part of the first: 5 / 4 of 5 / 4 of 5 / 4 of kTile,
                              // and what neighbours make too
constexpr int kRim = 1, kMaxPixels = (kMaxSide + 2 * kRim) * (kMaxSide + 2 * kRim);
constexpr int kThreads = 256;

// Pixels of a level along one axis: those that the block makes, and of these those that it writes.
struct Span {
    int first, end, first_own, end_own;
};

__device__ int size_of(const OrbLevel& level, uint32_t axis) {
    return axis == 0 ? level.width : level.height;
}

// Finds the spans of levels first to last, from what the last takes from each of those before it.
__device__ void find_spans(const OrbLevels& levels, int first, int last, uint32_t axis,
                           Span* spans) {
    const uint32_t tile = axis == 0 ? blockIdx.x : blockIdx.y,
                   tiles = axis == 0 ? gridDim.x : gridDim.y;
    const bool at_end = tile + 1 == tiles;
    const int begin = static_cast<int>(tile) * kTile;
    Span span{begin, begin + kTile, begin, begin + kTile};
    for (int l = last; l >= first; --l) {
        const int size = size_of(levels.level[l], axis);
        if (l < last)
            span = {span.first / 4 * 5, min((span.end + 3) / 4 * 5, size), span.first_own * 5 / 4,
                    span.end_own * 5 / 4};
        if (at_end) span.end = span.end_own = size;
        spans[l - first] = span;
    }
}

// A pixel, and in bit 8 whether it is usable.
using Sample = uint16_t;
constexpr uint32_t kUsable = 256;

// Calls body(column, row, index) for the block's share of width * height <= kMaxPixels pixels.
template <class Body>
__device__ void for_pixels(int width, int height, Body body) {
    const uint32_t columns = static_cast<uint32_t>(width),
                   count = columns * static_cast<uint32_t>(height);
    const uint32_t reciprocal = (1u << 20) / columns + 1;  // exact for so few pixels
    for (uint32_t i = threadIdx.x; i < count; i += kThreads) {
        const uint32_t row = i * reciprocal >> 20;
        body(static_cast<int>(i - row * columns), static_cast<int>(row), i);
    }
}

struct Part {
    const OrbLevel& level;
    const Span &x, &y;
    __device__ int width() const { return x.end - x.first; }
    __device__ int height() const { return y.end - y.first; }
};

__device__ void keep(const Part& part, const OrbMemory& memory, int x, int y, uint32_t sample) {
    if (x < part.x.first_own || y < part.y.first_own || x >= part.x.end_own || y >= part.y.end_own)
        return;
    const uint32_t at = part.level.first + static_cast<uint32_t>(y * part.level.stride + x);
    memory.pyramid[at] = static_cast<uint8_t>(sample);
    if (memory.mask != nullptr) memory.usable[at] = static_cast<uint8_t>(sample / kUsable);
}

// The halved image under the binomial window.
template <int kHalvings>
__device__ void soften(const Part& part, const OrbMemory& memory, int stride, Sample* gray,
                       Sample* result) {
    const int width = part.width() + 2 * kRim, last_x = part.level.width - 1,
              last_y = part.level.height - 1;
    for_pixels(width, part.height() + 2 * kRim, [&](int column, int row, uint32_t i) {
        const int x = min(max(part.x.first + column - kRim, 0), last_x),
                  y = min(max(part.y.first + row - kRim, 0), last_y);
        const bool usable =
            memory.mask == nullptr || halved<kHalvings, true>(memory.mask, stride, x, y) != 0;
        gray[i] = static_cast<Sample>(halved<kHalvings, false>(memory.gray, stride, x, y) |
                                      (usable ? static_cast<int32_t>(kUsable) : 0));
    });
    __syncthreads();
    for_pixels(part.width(), part.height(), [&](int column, int row, uint32_t i) {
        const Sample* upper = gray + row * width + column;
        const auto across = [](const Sample* p) {
            return (p[0] & 255u) + 2 * (p[1] & 255u) + (p[2] & 255u);
        };
        const uint32_t sum = across(upper) + 2 * across(upper + width) + across(upper + 2 * width);
        const uint32_t sample = ((sum + 8) >> 4) | (upper[width + 1] & kUsable);
        result[i] = static_cast<Sample>(sample);
        keep(part, memory, part.x.first + column, part.y.first + row, sample);
    });
}

__device__ void load(const Part& part, const OrbMemory& memory, Sample* result) {
    for_pixels(part.width(), part.height(), [&](int column, int row, uint32_t i) {
        const uint32_t at =
            part.level.first +
            static_cast<uint32_t>((part.y.first + row) * part.level.stride + part.x.first + column);
        const bool usable = memory.mask == nullptr || memory.usable[at] != 0;
        result[i] = static_cast<Sample>(memory.pyramid[at] | (usable ? kUsable : 0));
    });
}

__device__ void shrink(const Part& from, const Part& to, const OrbMemory& memory,
                       const Sample* source, Sample* result) {
    const int stride = from.width();
    for_pixels(to.width(), to.height(), [&](int column, int row, uint32_t i) {
        const int x = to.x.first + column, y = to.y.first + row;
        const Sample* upper = source + ((y >> 2) * 5 + (y & 3) - from.y.first) * stride +
                              ((x >> 2) * 5 + (x & 3) - from.x.first);
        const Sample* lower = upper + stride;
        const uint32_t right = 1 + 2 * (static_cast<uint32_t>(x) & 3),
                       below = 1 + 2 * (static_cast<uint32_t>(y) & 3);
        const auto across = [&](const Sample* p) {
            return (8 - right) * (p[0] & 255u) + right * (p[1] & 255u);
        };
        const uint32_t value = ((8 - below) * across(upper) + below * across(lower) + 32) >> 6;
        const uint32_t sample = value | (upper[0] & upper[1] & lower[0] & lower[1] & kUsable);
        result[i] = static_cast<Sample>(sample);
        keep(to, memory, x, y, sample);
    });
}

// Level 0 and those behind it up to `last`, or those behind `first`.
template <int kHalvings>
__global__ void __launch_bounds__(kThreads)
    make_levels(OrbLevels levels, int first, int last, OrbMemory memory) {
    __shared__ Span spans[2][kLevelsAtOnce];
    __shared__ Sample images[2][kMaxPixels];
    if (threadIdx.x < 2) find_spans(levels, first, last, threadIdx.x, spans[threadIdx.x]);
    __syncthreads();
    const auto part = [&](int l) {
        return Part{levels.level[l], spans[0][l - first], spans[1][l - first]};
    };
    Sample *from = images[0], *to = images[1];
    if (first == 0) {
        soften<kHalvings>(part(0), memory, levels.stride, to, from);
    } else {
        load(part(first), memory, from);
    }
    for (int l = first + 1; l <= last; ++l) {
        __syncthreads();
        shrink(part(l - 1), part(l), memory, from, to);
        Sample* const made = to;
        to = from;
        from = made;
    }
}

}  // namespace

void record_orb_pyramid(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory) {
    constexpr decltype(&make_levels<0>) kKernels[] = {make_levels<0>, make_levels<1>,
                                                      make_levels<2>, make_levels<3>};
    for (int first = 0, last = -1; last < levels.levels - 1; first = last) {
        last = std::min(first + kLevelsAtOnce, levels.levels) - 1;
        const auto tiles = [](int side) { return cover(static_cast<uint32_t>(side), kTile); };
        const OrbLevel& level = levels.level[last];
        recorder.launch(kKernels[levels.halvings],
                        {dim3(tiles(level.width), tiles(level.height)), kThreads}, levels, first,
                        last, memory);
    }
}

}  // namespace defrec::cuda
