// Stage align: what a patch's warp keeps in shared memory, the sampled template and the window of the live image, and sums over the warp.
// docs/stages/align.md.
#pragma once
#include "backends/cuda/launch.hpp"
#include "backends/shared/align_math.hpp"

namespace defrec::cuda {
namespace {
using namespace align;

// An exact sum, in any order.
__device__ uint32_t sum_of_warp(uint32_t value) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
    for (int step = 16; step > 0; step /= 2) value += __shfl_xor_sync(kAllLanes, value, step);
    return value;
#else
    return __reduce_add_sync(kAllLanes, value);
#endif
}
__device__ int32_t sum_of_warp(int32_t value) { return static_cast<int32_t>(sum_of_warp(static_cast<uint32_t>(value))); }
__device__ int32_t most_of_warp(int32_t value) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
    for (int step = 16; step > 0; step /= 2) value = max(value, __shfl_xor_sync(kAllLanes, value, step));
    return value;
#else
    return __reduce_max_sync(kAllLanes, value);
#endif
}

// The live image and its mask (or nullptr) at the level that is searched.
struct Level {
    const uint8_t *gray, *mask;
    int32_t width, height, stride;
    // Whether a pixel has `border` more on every side.
    __device__ bool inside(int2 pixel, int32_t border) const {
        return pixel.x >= border && pixel.y >= border && pixel.x + border < width && pixel.y + border < height;
    }
};

// Of patches with a radius.
template <int kRadius>
struct Layout {
    static constexpr int kSide = 2 * kRadius + 1, kPixels = kSide * kSide;
    static constexpr int kSampled = kSide + 2;        // with one pixel more on every side
    static constexpr int kBlocks = (kSide + 3) / 4;   // of four columns
    static constexpr int kLead = 8;                   // the patch's first column in a row of samples, so that rows load as vectors
    static constexpr int kPitch = kLead + (kSide + 8) / 8 * 8;  // samples from row to row
    // In the refinement a lane has some rows of a column.
    static constexpr int kGroups = kWarp / kSide, kRows = (kSide + kGroups - 1) / kGroups;
};

// The live pixels that search and refinement see, four in a word. Row 0 and column 0 are one before the first displacement's first pixel;
// column 0 is byte 3 of a row, so that displacement 0 begins with a word.
template <int kRadius>
struct WindowSize {
    int32_t side, words, rows;  // pixels along one side; words in a row; rows, with those that lanes without a pixel read
    constexpr explicit WindowSize(int32_t search_radius)
        : side(2 * (kRadius + search_radius) + 3),
          words((2 * search_radius + 4) / 4 + Layout<kRadius>::kBlocks + 1),
          rows(side + Layout<kRadius>::kGroups * Layout<kRadius>::kRows - Layout<kRadius>::kSide) {}
    constexpr int32_t size() const { return words * rows; }
};
constexpr int kLeadingBytes = 3;

template <int kRadius>
struct Window {
    WindowSize<kRadius> size;
    uint32_t* live;
    uint32_t* usable;  // 255 or 0 for each pixel; only where some are not usable
    bool masked;       // some are not
};

// Loads the window whose pixel 0 is at `corner`. Pixels outside the image are 0, and usable: what sees them is not scored.
template <int kRadius>
__device__ Window<kRadius> load_window(const Level& level, int2 corner, int32_t search_radius) {
    const WindowSize<kRadius> size(search_radius);
    uint32_t* const words = dynamic_shared<uint32_t>();
    uint8_t* const live = reinterpret_cast<uint8_t*>(words) + kLeadingBytes;
    uint8_t* const usable_pixels = live + 4 * size.size();
    bool hidden = false;
    for (int32_t row = 0; row < size.side; ++row) {
        const int32_t y = corner.y + row;
        for (int32_t column = static_cast<int32_t>(threadIdx.x); column < size.side; column += kWarp) {
            const int32_t x = corner.x + column, at = 4 * row * size.words + column;
            const bool in_image = x >= 0 && y >= 0 && x < level.width && y < level.height;
            const int64_t from = int64_t{y} * level.stride + x;
            live[at] = in_image ? __ldg(level.gray + from) : 0;
            if (level.mask == nullptr) continue;
            const bool usable_here = !in_image || __ldg(level.mask + from) != 0;
            usable_pixels[at] = usable_here ? 255 : 0;
            hidden = hidden || !usable_here;
        }
    }
    return {size, words, words + size.size(), __any_sync(kAllLanes, hidden) != 0};
}

// The patch sampled from its view, 1/16 gray level, still with its mean.
template <int kRadius>
struct Template : Layout<kRadius> {
    using L = Layout<kRadius>;
    uint16_t* samples;
    int32_t mean, t, tt;  // sums over the patch, less the mean
    bool textured;

    __device__ int32_t at(int32_t column, int32_t row) const { return samples[(row + 1) * L::kPitch + L::kLead + column]; }
    // Four columns of a row.
    __device__ uint2 block(int32_t row, int32_t index) const {
        return reinterpret_cast<const uint2*>(samples + (row + 1) * L::kPitch + L::kLead)[index];
    }
};

// view: doubled, width x height. centre: of the patch in the view, 1/256 px of the level. Not textured also where a sample needs a pixel
// outside the view.
template <int kRadius>
__device__ Template<kRadius> sample_view(const uint8_t* view, int32_t width, int32_t height, int2 centre, const int32_t matrix[4],
                                         int2 fraction, int64_t least_spread) {
    using L = Layout<kRadius>;
    alignas(16) __shared__ uint16_t samples[L::kSampled * L::kPitch];
    uint32_t sum = 0, squares = 0;  // of 225 values up to 4080: fits
    bool outside = false;
    for (int32_t i = static_cast<int32_t>(threadIdx.x); i < L::kSampled * L::kSampled; i += kWarp) {
        const int32_t column = i % L::kSampled - 1, row = i / L::kSampled - 1;
        const int32_t dx = 256 * (column - kRadius) - fraction.x, dy = 256 * (row - kRadius) - fraction.y;
        const int32_t x = 256 * centre.x + ((matrix[0] * dx + matrix[1] * dy + 128) >> 8);
        const int32_t y = 256 * centre.y + ((matrix[2] * dx + matrix[3] * dy + 128) >> 8);
        const int32_t left = x >> 15, upper = y >> 15, right_weight = (x >> 7) & 255, lower_weight = (y >> 7) & 255;
        if (left < 0 || upper < 0 || left + 1 >= width || upper + 1 >= height) {
            outside = true;
            continue;
        }
        const uint8_t* pixel = view + int64_t{upper} * width + left;
        const int32_t above = __ldg(pixel) * (256 - right_weight) + __ldg(pixel + 1) * right_weight;
        const int32_t below = __ldg(pixel + width) * (256 - right_weight) + __ldg(pixel + width + 1) * right_weight;
        const uint32_t value = static_cast<uint32_t>((above * (256 - lower_weight) + below * lower_weight + 2048) >> 12);
        samples[(row + 1) * L::kPitch + L::kLead + column] = static_cast<uint16_t>(value);
        if (column < 0 || row < 0 || column >= L::kSide || row >= L::kSide) continue;
        sum += value;
        squares += value * value;
    }
    sum = sum_of_warp(sum);
    squares = sum_of_warp(squares);
    constexpr uint32_t n = L::kPixels;
    const uint32_t mean = (2 * sum + n) / (2 * n);
    Template<kRadius> result;
    result.samples = samples;
    result.mean = static_cast<int32_t>(mean);
    result.t = static_cast<int32_t>(sum - n * mean);
    result.tt = static_cast<int32_t>(squares - 2 * mean * sum + n * mean * mean);
    result.textured = !__any_sync(kAllLanes, outside) && int64_t{n} * squares - int64_t{sum} * sum >= least_spread;
    return result;
}

}  // namespace
}  // namespace defrec::cuda
