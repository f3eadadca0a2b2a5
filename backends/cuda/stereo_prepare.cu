// Stage stereo, sections 1 and 2: both images inpainted and halved. A block has a tile of one of
// them; most tiles have nothing to inpaint.
#include "backends/cuda/stereo_steps.hpp"
#include "backends/cuda/stereo_windows.cuh"

namespace defrec::cuda {
namespace {

constexpr int kWidth = 64, kHeight = 32, kThreads = 256, kRun = 8;
constexpr int kHalfWidth = kWidth / 2, kHalfHeight = kHeight / 2;
constexpr int kReachWidth = kWidth + 2 * kInpaintRadius,
              kReachHeight = kHeight + 2 * kInpaintRadius;
constexpr int kOne = 1 << 20;  // a cell counts its pixel above the sum of grays

struct alignas(16) Tile {
    uint32_t gray[kHeight][kWidth / 4], usable[kHeight][kWidth / 4];  // usable: bytes 0 or 1
    int cells[kReachHeight][kReachWidth + 4], rows[kReachHeight][kWidth + 4];
};
static_assert(kInpaintRadius % 4 == 0 && kReachWidth % 8 == 0 &&
              kWidth % 8 == 0);  // rows of vectors, an odd number of them

// Four pixels of a row; 0 outside the image.
__device__ uint32_t four_pixels(const uint8_t* image, const StereoShape& shape, int x, int y,
                                bool aligned) {
    if (x < 0 || y < 0 || y >= shape.height || x >= shape.width) return 0;
    const uint8_t* at = image + int64_t{y} * shape.stride + x;
    if (aligned && x + 4 <= shape.width) return *reinterpret_cast<const uint32_t*>(at);
    uint32_t word = 0;
    for (int k = 0; k < min(4, shape.width - x); ++k) word |= uint32_t{at[k]} << (8 * k);
    return word;
}

// Bytes that are not 0 become 1.
__device__ uint32_t nonzero_bytes(uint32_t word) {
    return (((word & 0x7f7f7f7f) + 0x7f7f7f7f) | word) >> 7 & 0x01010101;
}

__device__ void inpaint(Tile& tile, const PreparedImage& image, const StereoShape& shape, int left,
                        int top, bool aligned) {
    const int thread = static_cast<int>(threadIdx.x);
    for (int i = thread; i < kReachWidth / 4 * kReachHeight; i += kThreads) {
        const int column = i % (kReachWidth / 4) * 4, row = i / (kReachWidth / 4),
                  x = left - kInpaintRadius + column, y = top - kInpaintRadius + row;
        const uint32_t gray = four_pixels(image.source, shape, x, y, aligned),
                       mask = four_pixels(image.mask, shape, x, y, aligned);
        const auto cell = [&](int k) {
            return (mask >> (8 * k) & 0xff) != 0 ? kOne + static_cast<int>(gray >> (8 * k) & 0xff)
                                                 : 0;
        };
        *reinterpret_cast<int4*>(&tile.cells[row][column]) =
            make_int4(cell(0), cell(1), cell(2), cell(3));
    }
    __syncthreads();
    alignas(16) int line[kRun + 2 * kInpaintRadius];
    int sums[kRun];
    for (int i = thread; i < kReachHeight * (kWidth / kRun); i += kThreads) {
        const int row = i % kReachHeight, column = i / kReachHeight * kRun;
#pragma unroll
        for (int u = 0; u < kRun + 2 * kInpaintRadius; u += 4)
            *reinterpret_cast<int4*>(line + u) =
                *reinterpret_cast<const int4*>(&tile.cells[row][column + u]);
        sum_along<kInpaintRadius, kRun, 1>(line, sums);
#pragma unroll
        for (int u = 0; u < kRun; u += 4)
            *reinterpret_cast<int4*>(&tile.rows[row][column + u]) =
                make_int4(sums[u], sums[u + 1], sums[u + 2], sums[u + 3]);
    }
    __syncthreads();
    auto* const gray = reinterpret_cast<uint8_t*>(tile.gray);
    const auto* const usable = reinterpret_cast<const uint8_t*>(tile.usable);
    for (int i = thread; i < kWidth * (kHeight / kRun); i += kThreads) {
        const int column = i % kWidth, row = i / kWidth * kRun;
#pragma unroll
        for (int v = 0; v < kRun + 2 * kInpaintRadius; ++v) line[v] = tile.rows[row + v][column];
        sum_along<kInpaintRadius, kRun, 1>(line, sums);
#pragma unroll
        for (int v = 0; v < kRun; ++v) {
            const int at = (row + v) * kWidth + column;
            if (usable[at] != 0) continue;
            const int sum = sums[v] & (kOne - 1), n = sums[v] >> 20;
            gray[at] = static_cast<uint8_t>(n == 0 ? 128 : (2 * sum + n) / (2 * n));
        }
    }
    __syncthreads();
}

// Two half pixels beside each other from four pixels of two rows.
__device__ void halve(const Tile& tile, const PreparedImage& image, const StereoShape& shape,
                      int left, int top) {
    for (int i = static_cast<int>(threadIdx.x); i < kWidth / 4 * (kHalfHeight / kBandRows);
         i += kThreads) {
        const int quad = i % (kWidth / 4), band = i / (kWidth / 4), x = left / 2 + 2 * quad,
                  y = top / 2 + band * kBandRows;
        if (x >= shape.half_width || y >= shape.half_height) continue;
        const bool both = x + 1 < shape.half_width, last = x + 2 >= shape.half_width;
        uint2 words = make_uint2(0, 0);
#pragma unroll
        for (int k = 0; k < kBandRows; ++k) {
            if (y + k >= shape.half_height) break;
            const int row = 2 * (band * kBandRows + k);
            const uint32_t above = tile.gray[row][quad], below = tile.gray[row + 1][quad];
            const auto mean = [&](uint32_t pair) {
                return __dp4a(above, pair, __dp4a(below, pair, 2u)) >> 2;
            };
            // After the last pixel it is repeated.
            const uint32_t first = mean(0x0101u), second = both ? mean(0x01010000u) : first;
            uint8_t* const to = image.half + (y + k) * gray_stride(shape.half_stride) + x;
            *reinterpret_cast<uint16_t*>(to) = static_cast<uint16_t>(first | second << 8);
            if (x == 0) *reinterpret_cast<uint32_t*>(to - 4) = 0x01010101u * first;
            if (last)
                for (int u = 2; u < 10; u += 2)
                    *reinterpret_cast<uint16_t*>(to + u) = static_cast<uint16_t>(0x101 * second);
            words.x |= ((first - 128) & 255) << (8 * k);
            words.y |= ((second - 128) & 255) << (8 * k);
            if (k % 2 != 0) continue;
            const uint32_t rows = tile.usable[row][quad] & tile.usable[row + 1][quad],
                           usable = rows & rows >> 8;  // bytes 0 and 2
            *reinterpret_cast<uint16_t*>(image.half_mask + (y + k) / 2 * shape.half_stride + x) =
                static_cast<uint16_t>((usable & 1) | (usable >> 8 & 0x100));
        }
        *reinterpret_cast<uint2*>(image.words + y / kBandRows * shape.half_stride + x) = words;
    }
}

__global__ void __launch_bounds__(kThreads) prepare(PrepareStep step) {
    __shared__ Tile tile;
    const StereoShape& shape = step.shape;
    const PreparedImage& image = blockIdx.z == 0 ? step.images[0] : step.images[1];
    const int left = static_cast<int>(blockIdx.x) * kWidth,
              top = static_cast<int>(blockIdx.y) * kHeight;
    const int thread = static_cast<int>(threadIdx.x);
    // All reads before anything that waits for one.
    constexpr int kRounds = kHeight * (kWidth / 4) / kThreads;
    static_assert(kRounds * kThreads == kHeight * (kWidth / 4));
    uint32_t gray[kRounds], mask[kRounds];
#pragma unroll
    for (int round = 0; round < kRounds; ++round) {
        const int i = thread + round * kThreads, x = left + i % (kWidth / 4) * 4,
                  y = top + i / (kWidth / 4);
        gray[round] = four_pixels(image.source, shape, x, y, step.words_aligned);
        mask[round] = image.mask != nullptr && y < shape.height
                          ? four_pixels(image.mask, shape, x, y, step.words_aligned)
                          : 0x01010101;
    }
    bool masked = false;
#pragma unroll
    for (int round = 0; round < kRounds; ++round) {
        const int i = thread + round * kThreads, quad = i % (kWidth / 4), row = i / (kWidth / 4);
        const uint32_t usable = nonzero_bytes(mask[round]);
        masked |= usable != 0x01010101;
        tile.gray[row][quad] = gray[round];
        tile.usable[row][quad] = usable;
    }
    if (__syncthreads_or(masked) != 0) inpaint(tile, image, shape, left, top, step.words_aligned);

    for (int i = thread; i < kHeight * (kWidth / 4); i += kThreads) {
        const int quad = i % (kWidth / 4), row = i / (kWidth / 4), x = left + 4 * quad,
                  y = top + row;
        if (y >= shape.height || x >= shape.width) continue;
        uint32_t word = tile.gray[row][quad];
        uint32_t* const to =
            reinterpret_cast<uint32_t*>(image.gray + y * gray_stride(shape.full_stride) + x);
        if (x == 0) to[-1] = 0x01010101u * (word & 0xff);
        if (x + 4 >= shape.width) {
            const int after = 8 * (shape.width - x);  // bits of pixels of the image
            const uint32_t last = 0x01010101u * (word >> (after - 8) & 0xff);
            if (after < 32) word = (word & ((1u << after) - 1)) | last << after;
            to[1] = to[2] = last;
        }
        *to = word;
        if (image.given == nullptr) continue;
        for (int k = 0; k < min(4, shape.width - x); ++k)
            image.given[int64_t{y} * shape.width + x + k] = static_cast<uint8_t>(word >> (8 * k));
    }
    halve(tile, image, shape, left, top);
    if (blockIdx.z == 0) return;
    for (int i = thread; i < kHalfWidth * (kHalfHeight / 2); i += kThreads) {
        const int x = left / 2 + i % kHalfWidth, row = top / 4 + i / kHalfWidth;
        if (x < shape.half_width && row < shape.half_samples_y)
            step.right_keys[row * shape.half_width + x] = 0;
    }
}

}  // namespace

void record_prepare(Recorder& recorder, const PrepareStep& step) {
    const auto columns = static_cast<uint32_t>(step.shape.width),
               rows = static_cast<uint32_t>(step.shape.height);
    recorder.launch(prepare,
                    {dim3(cover(columns, kWidth), cover(rows, kHeight), 2), dim3(kThreads)}, step);
}

}  // namespace defrec::cuda
