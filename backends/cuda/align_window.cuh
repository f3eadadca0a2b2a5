// Stage align: what a patch's warp keeps in shared memory, the sampled template and the window of
// the live image, and sums over the warp. docs/stages/align.md.
#pragma once
#include "backends/cuda/device/launch.hpp"
#include "backends/definition/align_math.hpp"

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
__device__ int32_t sum_of_warp(int32_t value) {
    return static_cast<int32_t>(sum_of_warp(static_cast<uint32_t>(value)));
}
__device__ int32_t max_of_warp(int32_t value) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
    for (int step = 16; step > 0; step /= 2)
        value = max(value, __shfl_xor_sync(kAllLanes, value, step));
    return value;
#else
    return __reduce_max_sync(kAllLanes, value);
#endif
}

// The live image and its mask (or nullptr; 0 is not usable) at the level that is searched, four
// pixels in a word, rows of whole words.
struct Level {
    const uint32_t *gray, *mask;
    int32_t width, height, row_words;
    // Whether a pixel has `border` more on every side.
    __device__ bool inside(int2 pixel, int32_t border) const {
        return pixel.x >= border && pixel.y >= border && pixel.x + border < width &&
               pixel.y + border < height;
    }
};

// Layout of patches with a radius.
template <int kRadius>
struct Layout {
    static constexpr int kSide = 2 * kRadius + 1, kPixels = kSide * kSide;
    static constexpr int kSampled = kSide + 2;       // with one pixel more on every side
    static constexpr int kBlocks = (kSide + 3) / 4;  // of four columns
    static constexpr int kLead =
        8;  // the patch's first column in a row of samples, so that rows load as vectors
    static constexpr int kPitch = kLead + (kSide + 8) / 8 * 8;  // samples from row to row
    // In the refinement a lane has some rows of a column.
    static constexpr int kGroups = kWarp / kSide, kRows = (kSide + kGroups - 1) / kGroups;
};

// The live pixels that search and refinement see, four in a word. Row 0 and column 0 are one before
// the first displacement's first pixel; column 0 is byte 3 of a row, so that displacement 0 begins
// with a word.
template <int kRadius>
struct WindowSize {
    int32_t words, rows;  // words in a row; rows, with those that lanes without a pixel read
    constexpr explicit WindowSize(int32_t search_radius)
        : words((2 * search_radius + 4) / 4 + Layout<kRadius>::kBlocks + 1),
          rows(2 * (kRadius + search_radius) + 3 +
               Layout<kRadius>::kGroups * Layout<kRadius>::kRows - Layout<kRadius>::kSide) {}
    constexpr int32_t size() const { return words * rows; }
};
constexpr int kLeadingBytes = 3;

template <int kRadius>
struct Window {
    WindowSize<kRadius> size;
    uint32_t* live;
    uint32_t* usable;  // 255 or 0 for each pixel; only with a mask
    bool masked;       // some are not usable
};

// 255 for each byte that is not 0.
__device__ uint32_t spread(uint32_t bytes) {
    const uint32_t top = (((bytes & 0x7f7f7f7fu) + 0x7f7f7f7fu) | bytes) & 0x80808080u;
    return (top >> 7) * 255;
}

// Loads the window whose pixel 0 is at `corner`. What it gives for pixels outside the image is any
// pixel's: displacements that see them are not scored.
template <int kRadius>
__device__ Window<kRadius> load_window(const Level& level, int2 corner, int32_t search_radius) {
    constexpr int kBatch = 4;  // loads under way at once
    const WindowSize<kRadius> size(search_radius);
    uint32_t* const live = dynamic_shared<uint32_t>();
    uint32_t* const usable = live + size.size();
    const int32_t lane = static_cast<int32_t>(threadIdx.x),
                  rows_at_once = static_cast<int32_t>(kWarp) / size.words;
    const int32_t word = lane % size.words, first_row = lane / size.words,
                  rows = first_row < rows_at_once ? size.rows : 0;
    const int32_t last = level.row_words * level.height - 1;
    const int32_t x = corner.x - kLeadingBytes + 4 * word, shift = 8 * (x & 3);
    bool hidden = false;
    for (int32_t first = first_row; first < rows; first += kBatch * rows_at_once) {
        uint32_t low[kBatch], high[kBatch], mask_low[kBatch], mask_high[kBatch];
        for (int k = 0; k < kBatch; ++k) {
            const int32_t at = (corner.y + first + k * rows_at_once) * level.row_words + (x >> 2);
            const int32_t here = min(max(at, 0), last), next = min(max(at + 1, 0), last);
            low[k] = __ldg(level.gray + here);
            high[k] = __ldg(level.gray + next);
            mask_low[k] = mask_high[k] = 0xffffffffu;
            if (level.mask == nullptr) continue;
            mask_low[k] = __ldg(level.mask + here);
            mask_high[k] = __ldg(level.mask + next);
        }
        for (int k = 0; k < kBatch; ++k) {
            const int32_t row = first + k * rows_at_once;
            if (row >= rows) break;
            live[row * size.words + word] =
                __funnelshift_r(low[k], high[k], static_cast<uint32_t>(shift));
            if (level.mask == nullptr) continue;
            const uint32_t seen =
                spread(__funnelshift_r(mask_low[k], mask_high[k], static_cast<uint32_t>(shift)));
            usable[row * size.words + word] = seen;
            hidden = hidden || seen != 0xffffffffu;
        }
    }
    return {size, live, usable, __any_sync(kAllLanes, hidden) != 0};
}

// The patch sampled from its view, 1/16 gray level, still with its mean.
template <int kRadius>
struct Template : Layout<kRadius> {
    using L = Layout<kRadius>;
    uint16_t* samples;
    int32_t mean, t, tt;  // sums over the patch, less the mean
    bool textured;

    __device__ int32_t at(int32_t column, int32_t row) const {
        return samples[(row + 1) * L::kPitch + L::kLead + column];
    }
    // Four columns of a row.
    __device__ uint2 block(int32_t row, int32_t index) const {
        return reinterpret_cast<const uint2*>(samples + (row + 1) * L::kPitch + L::kLead)[index];
    }
};

// view: doubled, width x height. centre: of the patch in the view, 1/256 px of the level. Not
// textured also where a sample needs a pixel outside the view.
template <int kRadius>
__device__ Template<kRadius> sample_view(const uint8_t* view, int32_t width, int32_t height,
                                         int2 centre, const int32_t matrix[4], int2 fraction,
                                         int64_t min_spread) {
    using L = Layout<kRadius>;
    alignas(16) __shared__ uint16_t samples[L::kSampled * L::kPitch];
    constexpr int kRounds =
        (L::kSampled * L::kSampled + static_cast<int>(kWarp) - 1) / static_cast<int>(kWarp);
    const int32_t lane = static_cast<int32_t>(threadIdx.x);
    int32_t pixels[kRounds][4], right_weight[kRounds], lower_weight[kRounds];
    bool outside = false;
    for (int k = 0; k < kRounds; ++k) {  // every load before the first use
        const int32_t i =
            min(lane + k * static_cast<int32_t>(kWarp), L::kSampled * L::kSampled - 1);
        const int32_t dx = kPatchOne * (i % L::kSampled - 1 - kRadius) - fraction.x,
                      dy = kPatchOne * (i / L::kSampled - 1 - kRadius) - fraction.y;
        const int32_t x = 256 * centre.x + ((matrix[0] * dx + matrix[1] * dy + 128) >> 8);
        const int32_t y = 256 * centre.y + ((matrix[2] * dx + matrix[3] * dy + 128) >> 8);
        const int32_t left = min(max(x >> 15, 0), width - 2),
                      upper = min(max(y >> 15, 0), height - 2);
        outside = outside || left != x >> 15 || upper != y >> 15;
        right_weight[k] = (x >> 7) & 255;
        lower_weight[k] = (y >> 7) & 255;
        const uint8_t* pixel = view + int64_t{upper} * width + left;
        pixels[k][0] = __ldg(pixel);
        pixels[k][1] = __ldg(pixel + 1);
        pixels[k][2] = __ldg(pixel + width);
        pixels[k][3] = __ldg(pixel + width + 1);
    }
    uint32_t sum = 0, squares = 0;  // of 225 values up to 4080: fits
    for (int k = 0; k < kRounds; ++k) {
        const int32_t i = lane + k * static_cast<int32_t>(kWarp), column = i % L::kSampled - 1,
                      row = i / L::kSampled - 1;
        const int32_t above =
            pixels[k][0] * (256 - right_weight[k]) + pixels[k][1] * right_weight[k];
        const int32_t below =
            pixels[k][2] * (256 - right_weight[k]) + pixels[k][3] * right_weight[k];
        const uint32_t value = static_cast<uint32_t>(
            (above * (256 - lower_weight[k]) + below * lower_weight[k] + 2048) >> 12);
        if (i < L::kSampled * L::kSampled)
            samples[(row + 1) * L::kPitch + L::kLead + column] = static_cast<uint16_t>(value);
        const bool inner = column >= 0 && row >= 0 && column < L::kSide && row < L::kSide;
        sum += inner ? value : 0;
        squares += inner ? value * value : 0;
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
    result.textured =
        !__any_sync(kAllLanes, outside) && int64_t{n} * squares - int64_t{sum} * sum >= min_spread;
    return result;
}

}  // namespace
}  // namespace defrec::cuda
