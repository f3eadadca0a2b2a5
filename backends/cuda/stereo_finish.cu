// Stage stereo, the end of section 10 and sections 11 to 13: speckles go, small holes are filled
// and the field is smoothed, in one pass over tiles of samples, with as much round them as that
// reaches; the result is interpolated from it. Passes of smoothing beyond what fits take further
// kernels.
#include "backends/cuda/stereo_smooth.cuh"
#include "backends/cuda/stereo_steps.hpp"
#include "backends/cuda/stereo_windows.cuh"

namespace defrec::cuda {
namespace {

constexpr int kLanes = static_cast<int>(kWarp), kThreads = 256, kWarps = kThreads / kLanes;
// Samples that are smoothed: the tile, and a column and a row after it, which its last pixels are
// interpolated from.
constexpr int kWidth = kLanes, kHeight = 16;
constexpr int kMaxReach = 4;  // of the passes of one kernel together
constexpr int kFieldHeight = kHeight + 2 * kMaxReach, kFieldStride = kWidth + 2 * kMaxReach;
constexpr int kMaxFillRadius = 4, kMaxMargin = kMaxReach + kMaxFillRadius + kSpeckleRadius;
constexpr int kReachWidth = 2 * kLanes, kReachHeight = kHeight + 2 * kMaxMargin;
static_assert(kWidth + 2 * kMaxMargin <= kReachWidth);

struct Field {  // (0, 0) is the first sample that the passes read
    float cells[kFieldHeight][kFieldStride], rows[kFieldHeight][kFieldStride];
};
struct Tile {
    Field field;
    uint32_t found[kReachHeight][kReachWidth];
    uint64_t before[kReachHeight], after[kReachHeight];  // bits of what is there in a row, with and
                                                         // without speckles
};

// `count` bits from `first` on.
__device__ __forceinline__ uint32_t bits_of(uint64_t row, int first, int count) {
    return static_cast<uint32_t>(row >> first) & ((1u << count) - 1);
}

__device__ __forceinline__ int disparity_of(const Found& found, bool known) {
    return known ? found.hypothesis + found.difference - kNoDifference : kNoDisparity;
}

// visit(column, row) for a rectangle: a warp a row, and then the columns that it has beyond those
// of a warp.
template <class Visit>
__device__ __forceinline__ void each(int width, int height, Visit&& visit) {
    const int thread = static_cast<int>(threadIdx.x), lane = thread % kLanes,
              further = width - kLanes;
    if (lane < width)
        for (int row = thread / kLanes; row < height; row += kWarps) visit(lane, row);
    for (int i = thread; i < further * height; i += kThreads)
        visit(kLanes + i % further, i / further);
}

// Section 12; kWidth x kHeight cells are left, `passes * kRadius` from the field's first.
template <int kRadius>
__device__ __forceinline__ void smooth_field(Field& field, int passes, float range) {
    for (int pass = 0; pass < passes; ++pass) {
        // What the pass reads begins at `first`; it leaves kRadius less on every side.
        const int first = pass * kRadius, further = 2 * (passes - pass - 1) * kRadius;
        float line[2 * kRadius + 1];
        each(kWidth + further, kHeight + further + 2 * kRadius, [&](int u, int v) {
            const int column = first + kRadius + u, row = first + v;
#pragma unroll
            for (int k = 0; k <= 2 * kRadius; ++k) line[k] = field.cells[row][column - kRadius + k];
            field.rows[row][column] = smooth_middle<kRadius>(line, range);
        });
        __syncthreads();
        each(kWidth + further, kHeight + further, [&](int u, int v) {
            const int column = first + kRadius + u, row = first + kRadius + v;
#pragma unroll
            for (int k = 0; k <= 2 * kRadius; ++k) line[k] = field.rows[row - kRadius + k][column];
            field.cells[row][column] = smooth_middle<kRadius>(line, range);
        });
        __syncthreads();
    }
}

// floor(value / 6) for |value| < 6144.
__device__ __forceinline__ int sixth(int value) { return ((value + 6144) * 10923 >> 16) - 1024; }

// Section 13 for the four pixels of the sample (i, j), from the cell of it.
__device__ __forceinline__ void give_pixels(const FinishStep& step, const float* cell, int i,
                                            int j) {
    const StereoShape& shape = step.shape;
    const int x = 2 * i, y = 2 * j;
    const int right = i + 1 < shape.samples_x ? 1 : 0,
              below = j + 1 < shape.samples_y ? kFieldStride : 0;
    const float here = cell[0];
    const auto range = static_cast<float>(shape.smooth_range);
    const int a = from_smooth(here);
    int sum = 0, n = 1;
    const auto difference_to = [&](float other) {
        const float difference = other - here;
        const bool near = fabsf(difference) <= range;
        const int value = near ? static_cast<int>(difference) : 0;
        sum += value;
        n += near;
        return value;
    };
    const int to_right = difference_to(cell[right]), to_below = difference_to(cell[below]);
    difference_to(cell[right + below]);
    const int mean = n == 1   ? 0
                     : n == 2 ? (sum + 1) >> 1
                     : n == 3 ? sixth(2 * sum + 3)
                              : (sum + 2) >> 2;
    const bool known = a != kNoDisparity;
    const auto pixel = [&](int change) { return static_cast<int16_t>(known ? a + change : a); };
    const int16_t rows[2][2] = {{pixel(0), pixel((to_right + 1) >> 1)},
                                {pixel((to_below + 1) >> 1), pixel(mean)}};
#pragma unroll
    for (int v = 0; v < 2; ++v) {
        if (y + v >= shape.height) break;
        int16_t* const to = step.disparity + int64_t{y + v} * shape.stride + x;
        if (step.pairs_aligned && x + 1 < shape.width) {
            *reinterpret_cast<short2*>(to) = make_short2(rows[v][0], rows[v][1]);
        } else {
            to[0] = rows[v][0];
            if (x + 1 < shape.width) to[1] = rows[v][1];
        }
    }
}

// The field's first sample is (left - reach, top - reach). next: where it goes, or nullptr for the
// result.
__device__ __forceinline__ void give_field(const FinishStep& step, const Field& field, int left,
                                           int top, int reach, int16_t* next) {
    const StereoShape& shape = step.shape;
    each(kWidth - 1, kHeight - 1, [&](int column, int row) {
        const int i = left + column, j = top + row;
        if (i >= shape.samples_x || j >= shape.samples_y) return;
        const float* const cell = &field.cells[reach + row][reach + column];
        if (next == nullptr)
            give_pixels(step, cell, i, j);
        else
            next[j * shape.samples_x + i] = static_cast<int16_t>(from_smooth(*cell));
    });
}

// Gives the pixels of the sample (i, j) its confidence.
__device__ __forceinline__ void give_confidence(const FinishStep& step, int confidence, int i,
                                                int j) {
    const StereoShape& shape = step.shape;
    const int x = 2 * i, y = 2 * j;
#pragma unroll
    for (int v = 0; v < 2; ++v) {
        if (y + v >= shape.height) break;
        uint8_t* const to = step.confidence + int64_t{y + v} * shape.stride + x;
        if (step.pairs_aligned && x + 1 < shape.width) {
            *reinterpret_cast<uint16_t*>(to) = static_cast<uint16_t>(confidence * 0x101);
        } else {
            to[0] = static_cast<uint8_t>(confidence);
            if (x + 1 < shape.width) to[1] = static_cast<uint8_t>(confidence);
        }
    }
}

// A block's samples: `margin` from the field's first are those whose results it gives, from (left,
// top) on.
struct Samples {
    int left, top, margin;

    // Whether the block gives the results of the sample in that place.
    __device__ __forceinline__ bool owned(const StereoShape& shape, int column, int row) const {
        return column >= margin && column < margin + kWidth - 1 && row >= margin &&
               row < margin + kHeight - 1 && left - margin + column < shape.samples_x &&
               top - margin + row < shape.samples_y;
    }
    __device__ __forceinline__ int rows() const { return kHeight + 2 * margin; }
};

// Loads the disparities that were found at the samples.
__device__ __forceinline__ void load_found(const FinishStep& step, const Samples& samples,
                                           Tile& tile) {
    const StereoShape& shape = step.shape;
    const int thread = static_cast<int>(threadIdx.x), warp = thread / kLanes,
              lane = thread % kLanes;
    constexpr int kRounds = (kReachHeight + kWarps - 1) / kWarps;
    uint32_t words[kRounds][2];
#pragma unroll
    for (int round = 0; round < kRounds; ++round)
#pragma unroll
        for (int part = 0; part < 2; ++part) {
            // Outside the field some sample is read that does not matter.
            const int i = samples.left - samples.margin + part * kLanes + lane,
                      j = samples.top - samples.margin + round * kWarps + warp,
                      at_i = clamped(i, 0, shape.samples_x - 1),
                      at_j = clamped(j, 0, shape.samples_y - 1);
            const uint32_t word = __ldg(step.found + at_j * shape.samples_x + at_i);
            words[round][part] = i == at_i && j == at_j ? word : 0;
        }
#pragma unroll
    for (int round = 0; round < kRounds; ++round) {
        const int row = round * kWarps + warp;
        if (row >= samples.rows()) break;
        uint64_t bits = 0;
#pragma unroll
        for (int part = 0; part < 2; ++part) {
            const uint32_t word = words[round][part];
            tile.found[row][part * kLanes + lane] = word;
            bits |= uint64_t{__ballot_sync(kAllLanes, unpack_found(word).difference != 0)}
                    << (part * kLanes);
        }
        if (lane == 0) tile.before[row] = bits;
    }
}

// The end of section 10: which of them are no speckles.
__device__ __forceinline__ void drop_speckles(const FinishStep& step, const Samples& samples,
                                              Tile& tile) {
    const StereoShape& shape = step.shape;
    const int thread = static_cast<int>(threadIdx.x), warp = thread / kLanes,
              lane = thread % kLanes;
#pragma unroll 2
    for (int row = kSpeckleRadius + warp; row < samples.rows() - kSpeckleRadius; row += kWarps) {
        constexpr int kSide = 2 * kSpeckleRadius + 1;
        uint64_t rows[kSide], bits = 0;
#pragma unroll
        for (int v = 0; v < kSide; ++v) rows[v] = tile.before[row - kSpeckleRadius + v];
#pragma unroll
        for (int part = 0; part < 2; ++part) {
            const int column = part * kLanes + lane;
            uint32_t there = 0;
#pragma unroll
            for (int v = 0; v < kSide; ++v)
                there |= bits_of(rows[v], max(column - kSpeckleRadius, 0), kSide) << (kSide * v);
            const Found found = unpack_found(tile.found[row][column]);
            const bool stays = found.difference != 0 && __popc(there) >= shape.support;
            bits |= uint64_t{__ballot_sync(kAllLanes, stays)} << (part * kLanes);
            if (step.given_evidence != nullptr && samples.owned(shape, column, row))
                step.given_evidence[(samples.top - samples.margin + row) * shape.samples_x +
                                    samples.left - samples.margin + column] =
                    static_cast<int16_t>(disparity_of(found, stays));
        }
        if (lane == 0) tile.after[row] = bits;
    }
}

// Section 11: the disparity of the hole in that place, whose neighbours within `radius` are more
// than half there.
__device__ __forceinline__ int filled_hole(const Tile& tile, int column, int row, int radius,
                                           int neighbours) {
    const int side = 2 * radius + 1;
    int sum = -kNoDifference * neighbours;
    for (int y = row - radius; y <= row + radius; ++y) {
        const uint32_t there = bits_of(tile.after[y], column - radius, side);
        for (int k = 0; k < side; ++k)
            if ((there >> k & 1) != 0)
                sum += unpack_found(tile.found[y][column - radius + k]).difference;
    }
    const int dividend = 2 * sum + neighbours, quotient = dividend / (2 * neighbours);
    return max(0, unpack_found(tile.found[row][column]).hypothesis + quotient -
                      (dividend - 2 * neighbours * quotient < 0));
}

// next: where the field goes if passes are left, or nullptr.
template <int kRadius>
__global__ void __launch_bounds__(kThreads) finish(FinishStep step, int passes, int16_t* next) {
    __shared__ Tile tile;
    const StereoShape& shape = step.shape;
    const int fill = shape.fill_radius, reach = passes * kRadius;
    const Samples samples{static_cast<int>(blockIdx.x) * (kWidth - 1),
                          static_cast<int>(blockIdx.y) * (kHeight - 1),
                          reach + fill + kSpeckleRadius};
    load_found(step, samples, tile);
    __syncthreads();
    drop_speckles(step, samples, tile);
    __syncthreads();
    each(kWidth + 2 * reach, kHeight + 2 * reach, [&](int u, int v) {
        const int column = u + fill + kSpeckleRadius, row = v + fill + kSpeckleRadius;
        const Found found = unpack_found(tile.found[row][column]);
        const bool known = bits_of(tile.after[row], column, 1) != 0;
        const int i = samples.left - samples.margin + column,
                  j = samples.top - samples.margin + row;
        int disparity = disparity_of(found, known), confidence = known ? found.confidence : 0;
        if (!known) {
            const int side = 2 * fill + 1;
            int m = 0;
            for (int y = row - fill; y <= row + fill; ++y)
                m += __popc(bits_of(tile.after[y], column - fill, side));
            if (2 * m >= side * side && i >= 0 && j >= 0 && i < shape.samples_x &&
                j < shape.samples_y) {
                disparity = filled_hole(tile, column, row, fill, m);
                confidence = kFilledConfidence;
            }
        }
        tile.field.cells[v][u] = to_smooth(disparity);
        if (!samples.owned(shape, column, row)) return;
        if (step.confidence != nullptr) give_confidence(step, confidence, i, j);
        if (step.given_filled != nullptr)
            step.given_filled[j * shape.samples_x + i] = static_cast<int16_t>(disparity);
    });
    __syncthreads();
    smooth_field<kRadius>(tile.field, passes, static_cast<float>(shape.smooth_range));
    give_field(step, tile.field, samples.left, samples.top, reach, next);
}

template <int kRadius>
__global__ void __launch_bounds__(kThreads)
    smooth(FinishStep step, int passes, const int16_t* from, int16_t* next) {
    __shared__ Field field;
    const StereoShape& shape = step.shape;
    const int reach = passes * kRadius;
    const int left = static_cast<int>(blockIdx.x) * (kWidth - 1),
              top = static_cast<int>(blockIdx.y) * (kHeight - 1);
    each(kWidth + 2 * reach, kHeight + 2 * reach, [&](int column, int row) {
        const int i = left - reach + column, j = top - reach + row;
        const bool inside = i >= 0 && j >= 0 && i < shape.samples_x && j < shape.samples_y;
        field.cells[row][column] =
            inside ? to_smooth(__ldg(from + j * shape.samples_x + i)) : kMissing;
    });
    __syncthreads();
    smooth_field<kRadius>(field, passes, static_cast<float>(shape.smooth_range));
    give_field(step, field, left, top, reach, next);
}

template <int kRadius>
void record_with(Recorder& recorder, const FinishStep& step) {
    const Grid grid{dim3(cover(static_cast<uint32_t>(step.shape.samples_x), kWidth - 1),
                         cover(static_cast<uint32_t>(step.shape.samples_y), kHeight - 1)),
                    dim3(kThreads)};
    int left = step.shape.smooth_passes;
    int16_t *from = nullptr, *to = step.fields[0], *other = step.fields[1];
    do {
        const int passes = std::min(left, kMaxReach / kRadius);
        left -= passes;
        int16_t* const next = left == 0 ? nullptr : to;
        if (from == nullptr)
            recorder.launch(finish<kRadius>, grid, step, passes, next);
        else
            recorder.launch(smooth<kRadius>, grid, step, passes, from, next);
        from = next;
        std::swap(to, other);
    } while (left > 0);
}

}  // namespace

void record_finish(Recorder& recorder, const FinishStep& step) {
    if (step.shape.smooth_radius == 1)
        record_with<1>(recorder, step);
    else
        record_with<2>(recorder, step);
}

}  // namespace defrec::cuda
