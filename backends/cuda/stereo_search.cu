// Stage stereo, section 3: the search, and what section 4 asks of a left pixel alone.
//
// A block has kBandRows rows of a tile of left pixels, and goes through the disparities kGroups
// groups of four at a time. A thread has one group for a run of pixels: it keeps the sums of
// products along the columns of its windows, for each of the four disparities, and moves them down
// from row to row by a product entering and one leaving. Windows, scores and the best of the group,
// for the left and for the right pixels, follow in registers; groups meet in shared memory. There
// is no volume of costs.
#include "backends/cuda/stereo_steps.hpp"
#include "backends/cuda/stereo_windows.cuh"

namespace defrec::cuda {
namespace {

constexpr int kRun = 8, kRuns = 8, kTile = kRun * kRuns, kRows = kBandRows;
constexpr int kMoves = kRows - 1;         // of the columns' sums, from the first row to the last
constexpr int kMeet = kRun + kGroup - 1;  // right pixels that a thread's pixels meet
constexpr int kWindowRun = 4;             // whose statistics a thread makes at once
constexpr int kMagic = 0x4b400000;  // the bits of 1.5 * 2^23: to them an integer below 2^22 is
                                    // added, and the float subtracted
constexpr int kInvalid = static_cast<int>(0x80000000);  // makes a key negative

constexpr int padded(int count) { return (count + 3) / 4 * 4; }

// The winner of a pixel, and the second, as the groups come in ascending order.
struct alignas(16) Contest {
    int winner, second;
    int last, before;  // best keys of the group before, and of all before that

    __device__ __forceinline__ void enter(int group, int best) {
        if (best > winner) {
            second = before;
            winner = best;
        } else if (group - (winner & 255) / kGroup > 1) {
            second = max(second, best);
        }
        before = max(before, last);
        last = best;
    }
};

// Columns are of windows, others are pixels. The right ones begin with what the first pixel meets
// at the largest disparity.
template <int kRadius, int kGroups>
struct Search {
    static constexpr int kThreads = kRuns * kGroups;
    static constexpr int kSide = 2 * kRadius + 1, kWords = (kSide + 3) / 4,
                         kBandWords = (kSide + kMoves + 3) / 4;
    static constexpr int kLeftLine = padded(kRun + 2 * kRadius),
                         kRightLine = padded(kMeet + 2 * kRadius);  // columns that a thread reads
    static constexpr int kReach = kTile + kGroup * kGroups;
    static constexpr int kLeftColumns = kTile - kRun + kLeftLine,
                         kRightColumns = kReach - kRun - kGroup + kRightLine;
    static constexpr int kBestStride = kRows * kTile + 4;
    static constexpr int kPixels = kRows * kTile / kThreads;  // whose groups a thread compares
    // Bytes of the last word of a column's first window.
    static constexpr uint32_t kLastBytes = kSide % 4 == 1 ? 0xffu : 0xffffffu;
    static_assert(kSide % 4 == 1 || kSide % 4 == 3);

    struct Statistics {
        int left_sums[kRows][kLeftColumns], left_squares[kRows][kLeftColumns];
        int right_sums[kRows][kRightColumns], right_squares[kRows][kRightColumns];
    };
    struct alignas(16) Shared {
        // Rows of a column's first window, four in a word; and for each move a word whose dot
        // product with that of the other image is the product entering less the one leaving: l,
        // ~l', 1 and r, r', r'.
        int left[kWords + kMoves][kLeftColumns], right[kWords + kMoves][kRightColumns];
        float left_mean[kRows][kTile], left_root[kRows][kTile];
        float right_sum[kRows][kReach], right_root[kRows][kReach];
        int right_keys[kRows][4][kReach / 4];  // pixel i is at i % 4, i / 4
        union {
            Statistics columns;
            int best[kGroups][kBestStride];
        };
        Contest contests[kPixels][kThreads];
        uint8_t textured[kRows][kTile];
    };
};

__device__ __forceinline__ int row_of(const uint32_t* words, int row) {
    return static_cast<int>(words[row / 4] >> (8 * (row % 4)) & 0xff);
}

// A column of a band: its words for the search, and sums and squares of its windows.
template <class S, bool kLeft, int kColumns>
__device__ __forceinline__ void stage_column(const SearchStep& step, const uint32_t* image, int x,
                                             int band, int column,
                                             int (&words)[S::kWords + kMoves][kColumns],
                                             int (&sums)[kRows][kColumns],
                                             int (&squares)[kRows][kColumns]) {
    const StereoShape& shape = step.shape;
    uint32_t rows[S::kBandWords];
#pragma unroll
    for (int q = 0; q < S::kBandWords; ++q)
        rows[q] = x >= 0 && x < shape.half_width && (band + q) * kBandRows < shape.half_height
                      ? image[(band + q) * shape.half_stride + x]
                      : 0;
    int sum = 0, square = 0;
#pragma unroll
    for (int q = 0; q < S::kWords; ++q) {
        const auto all = static_cast<int>(rows[q]),
                   inside =
                       static_cast<int>(q == S::kWords - 1 ? rows[q] & S::kLastBytes : rows[q]);
        sum = __dp4a(inside, 0x01010101, sum);
        square = __dp4a(inside, inside, square);
        words[q][column] = kLeft ? inside : all;
    }
    sums[0][column] = sum;
    squares[0][column] = square;
#pragma unroll
    for (int move = 0; move < kMoves; ++move) {
        const int enters = row_of(rows, S::kSide + move), leaves = row_of(rows, move);
        const auto entering = static_cast<int8_t>(enters), leaving = static_cast<int8_t>(leaves);
        words[S::kWords + move][column] =
            kLeft ? enters | (leaves ^ 0xff) << 8 | 1 << 16 : enters | leaves << 8 | leaves << 16;
        sum += entering - leaving;
        square += entering * entering - leaving * leaving;
        sums[move + 1][column] = sum;
        squares[move + 1][column] = square;
    }
}

template <int kCount>
__device__ __forceinline__ void load_floats(const float* from, float (&to)[kCount]) {
#pragma unroll
    for (int i = 0; i < kCount; i += 4) {
        const float4 four = *reinterpret_cast<const float4*>(from + i);
        to[i] = four.x;
        to[i + 1] = four.y;
        to[i + 2] = four.z;
        to[i + 3] = four.w;
    }
}
template <int kCount>
__device__ __forceinline__ void load_ints(const int* from, int (&to)[kCount]) {
#pragma unroll
    for (int i = 0; i < kCount; i += 4) {
        const int4 four = *reinterpret_cast<const int4*>(from + i);
        to[i] = four.x;
        to[i + 1] = four.y;
        to[i + 2] = four.z;
        to[i + 3] = four.w;
    }
}

// One row's windows of kWindowRun pixels from the sums along their columns.
template <int kRadius, int kColumns>
__device__ __forceinline__ void window_run(const int (&columns)[kRows][kColumns], int row,
                                           int first, int (&sums)[kWindowRun]) {
    int line[padded(kWindowRun + 2 * kRadius)], used[kWindowRun + 2 * kRadius];
    load_ints(&columns[row][first], line);
#pragma unroll
    for (int u = 0; u < kWindowRun + 2 * kRadius; ++u) used[u] = line[u];
    sum_along<kRadius, kWindowRun>(used, sums);
}

__device__ __forceinline__ void store(float* to, const float (&values)[kWindowRun]) {
    *reinterpret_cast<float4*>(to) = make_float4(values[0], values[1], values[2], values[3]);
}

__device__ __forceinline__ float score_of(int key) { return __int_as_float(key & ~255); }

// Keys of the thread's pixels in its four disparities. sums: along the columns.
template <class S, int kRadius>
__device__ __forceinline__ void score_row(typename S::Shared& shared, int row, int run, int reach,
                                          int slot, const int (&tags)[kGroup],
                                          const int (&sums)[kGroup][kRun + 2 * kRadius]) {
    float left_mean[kRun], left_root[kRun], right_sum[kRun + kGroup], right_root[kRun + kGroup];
    load_floats(&shared.left_mean[row][kRun * run], left_mean);
    load_floats(&shared.left_root[row][kRun * run], left_root);
    load_floats(&shared.right_sum[row][reach], right_sum);
    load_floats(&shared.right_root[row][reach], right_root);
    int best[kRun], met[kMeet], window[kGroup];
#pragma unroll
    for (int i = 0; i < kMeet; ++i) met[i] = 0;
#pragma unroll
    for (int k = 0; k < kGroup; ++k) {
        window[k] = kMagic;
#pragma unroll
        for (int u = 0; u < 2 * kRadius; ++u) window[k] += sums[k][u];
    }
#pragma unroll
    for (int m = 0; m < kRun; ++m) {
        best[m] = 0;
#pragma unroll
        for (int k = 0; k < kGroup; ++k) {
            const int i = m + kGroup - 1 - k;
            window[k] += sums[k][m + 2 * kRadius];
            const float products = __int_as_float(window[k]) - 0x1.8p23f;
            window[k] -= sums[k][m];
            const float covariance = products - left_mean[m] * right_sum[i];
            const float score = covariance * (left_root[m] * right_root[i]);
            const int key = (__float_as_int(score) & ~255) | tags[k];
            best[m] = max(best[m], key);
            met[i] = max(met[i], key);
        }
    }
    int* const to = &shared.best[slot][row * kTile + kRun * run];
#pragma unroll
    for (int m = 0; m < kRun; m += 4)
        *reinterpret_cast<int4*>(to + m) =
            make_int4(best[m], best[m + 1], best[m + 2], best[m + 3]);
#pragma unroll
    for (int i = 0; i < kMeet; ++i)
        atomicMax(&shared.right_keys[row][i % 4][reach / 4 + i / 4], met[i]);
}

template <int kRadius, int kGroups>
__global__ void __launch_bounds__(kRuns* kGroups, 512 / (kRuns * kGroups)) search(SearchStep step) {
    using S = Search<kRadius, kGroups>;
    __shared__ typename S::Shared shared;
    const StereoShape& shape = step.shape;
    const int thread = static_cast<int>(threadIdx.x), slot = thread % kGroups,
              run = thread / kGroups;
    const int band = static_cast<int>(blockIdx.y), top = kRadius + band * kRows;
    const int left = kRadius + shape.first + static_cast<int>(blockIdx.x) * kTile;
    const int reach =
        kGroup * (kGroups - 1 - slot) + kRun * run;  // the first right pixel that the thread meets
    const int groups = (shape.count + kGroup - 1) / kGroup;
    for (int first_group = 0; first_group < groups; first_group += kGroups) {
        const int right = left - shape.first - kGroup * (first_group + kGroups - 1) - (kGroup - 1);
        for (int i = thread; i < S::kLeftColumns + S::kRightColumns; i += S::kThreads) {
            const int j = i - S::kLeftColumns;
            if (j < 0)
                stage_column<S, true>(step, step.left, left - kRadius + i, band, i, shared.left,
                                      shared.columns.left_sums, shared.columns.left_squares);
            else
                stage_column<S, false>(step, step.right, right - kRadius + j, band, j, shared.right,
                                       shared.columns.right_sums, shared.columns.right_squares);
        }
        for (int i = thread; i < kRows * S::kReach; i += S::kThreads)
            (&shared.right_keys[0][0][0])[i] = 0;
        __syncthreads();

        constexpr int kWindowRuns = (kTile + S::kReach) / kWindowRun,
                      kPixelCount = S::kSide * S::kSide;
        for (int i = thread; i < kRows * kWindowRuns; i += S::kThreads) {
            const int row = i / kWindowRuns, pixel = i % kWindowRuns * kWindowRun,
                      reached = pixel - kTile, y = top + row;
            int sums[kWindowRun], squares[kWindowRun];
            float sum[kWindowRun], root[kWindowRun];
            uint32_t textured = 0;
            if (reached < 0) {
                window_run<kRadius>(shared.columns.left_sums, row, pixel, sums);
                window_run<kRadius>(shared.columns.left_squares, row, pixel, squares);
            } else {
                window_run<kRadius>(shared.columns.right_sums, row, reached, sums);
                window_run<kRadius>(shared.columns.right_squares, row, reached, squares);
            }
#pragma unroll
            for (int m = 0; m < kWindowRun; ++m) {
                const int x = (reached < 0 ? left + pixel : right + reached) + m;
                const bool whole = x >= kRadius && x < shape.half_width - kRadius &&
                                   y < shape.half_height - kRadius;
                const int variance = whole ? kPixelCount * squares[m] - sums[m] * sums[m] : 0;
                root[m] = inverse_root(variance);
                sum[m] = static_cast<float>(sums[m]) * (reached < 0 ? step.shape.one_over_n : 1.0f);
                textured |= variance >= step.shape.min_variance ? 1u << (8 * m) : 0u;
            }
            if (reached < 0) {
                store(&shared.left_mean[row][pixel], sum);
                store(&shared.left_root[row][pixel], root);
                *reinterpret_cast<uint32_t*>(&shared.textured[row][pixel]) = textured;
            } else {
                store(&shared.right_sum[row][reached], sum);
                store(&shared.right_root[row][reached], root);
            }
        }
        __syncthreads();

        // The group's disparities; those after the last have keys that never win.
        int tags[kGroup];
#pragma unroll
        for (int k = 0; k < kGroup; ++k) {
            const int index = kGroup * (first_group + slot) + k;
            tags[k] = index < shape.count ? index : kInvalid;
        }
        int sums[kGroup][kRun + 2 * kRadius];
#pragma unroll
        for (int k = 0; k < kGroup; ++k)
#pragma unroll
            for (int u = 0; u < kRun + 2 * kRadius; ++u) sums[k][u] = 0;
        const auto add_products = [&](int word) {
            int left_words[S::kLeftLine], right_words[S::kRightLine];
            load_ints(&shared.left[word][kRun * run], left_words);
            load_ints(&shared.right[word][reach], right_words);
#pragma unroll
            for (int k = 0; k < kGroup; ++k)
#pragma unroll
                for (int u = 0; u < kRun + 2 * kRadius; ++u)
                    sums[k][u] = __dp4a(left_words[u], right_words[u + kGroup - 1 - k], sums[k][u]);
        };
#pragma unroll
        for (int word = 0; word < S::kWords; ++word) add_products(word);
#pragma unroll 1
        for (int row = 0;; ++row) {
            score_row<S, kRadius>(shared, row, run, reach, slot, tags, sums);
            if (row == kRows - 1) break;
            add_products(S::kWords + row);
        }
        __syncthreads();

#pragma unroll
        for (int p = 0; p < S::kPixels; ++p) {
            Contest contest{0, 0, 0, 0};
            if (first_group > 0) contest = shared.contests[p][thread];
#pragma unroll 4
            for (int g = 0; g < min(kGroups, groups - first_group); ++g)
                contest.enter(first_group + g, shared.best[g][thread + p * S::kThreads]);
            shared.contests[p][thread] = contest;
        }
        for (int i = thread; i < kRows * S::kReach; i += S::kThreads) {
            const int row = i / S::kReach, at = i % S::kReach,
                      key = shared.right_keys[row][at % 4][at / 4];
            // A key of 255 or less has the score 0.
            if (key > 255)
                atomicMax(&step.right_keys[(top + row) * shape.half_width + right + at], key);
        }
        __syncthreads();
    }

#pragma unroll
    for (int p = 0; p < S::kPixels; ++p) {
        const int pixel = thread + p * S::kThreads, x = left + pixel % kTile,
                  y = top + pixel / kTile;
        if (x >= shape.half_width - kRadius || y >= shape.half_height - kRadius) continue;
        const Contest& contest = shared.contests[p][thread];
        const int key = contest.winner > 255 ? contest.winner : 0;
        const float lead = score_of(key) - score_of(contest.second);
        const bool good = key != 0 && score_of(key) >= shape.min_score && lead >= shape.min_lead &&
                          shared.textured[pixel / kTile][pixel % kTile] != 0;
        step.candidates[y * shape.half_stride + x] =
            static_cast<uint16_t>(good ? 1 + (key & 255) : 0);
        if (step.left_keys != nullptr) step.left_keys[y * shape.half_width + x] = key;
    }
}

template <int kGroups>
void record_with(Recorder& recorder, const SearchStep& step, dim3 blocks) {
    const Grid grid{blocks, dim3(kRuns * kGroups)};
    switch (step.shape.radius) {
        case 2:
            return recorder.launch(search<2, kGroups>, grid, step);
        case 3:
            return recorder.launch(search<3, kGroups>, grid, step);
        case 4:
            return recorder.launch(search<4, kGroups>, grid, step);
        case 5:
            return recorder.launch(search<5, kGroups>, grid, step);
        default:
            return recorder.launch(search<6, kGroups>, grid, step);
    }
}

}  // namespace

void record_search(Recorder& recorder, const SearchStep& step) {
    const StereoShape& shape = step.shape;
    const int columns = shape.half_width - 2 * shape.radius - shape.first,
              rows = shape.half_height - 2 * shape.radius;
    if (columns <= 0 || rows <= 0) return;
    const dim3 blocks(cover(static_cast<uint32_t>(columns), kTile),
                      cover(static_cast<uint32_t>(rows), kRows));
    if (shape.count <= kGroup * 8)
        record_with<8>(recorder, step, blocks);
    else
        record_with<16>(recorder, step, blocks);
}

}  // namespace defrec::cuda
