// Stage stereo, section 3: the search, and what section 4 asks of a left pixel alone.
//
// A block has a tile of left samples, and goes through the disparities kGroups groups of four at a
// time. A thread has one group for a run of samples in each row: it keeps the sums of products
// along the columns of its windows, for each of the four disparities, and moves them down two rows
// at a time by the products entering and leaving. Windows, scores and the best of the group, for
// the left samples and for the right pixels, follow in registers; groups meet in shared memory.
// There is no volume of costs.
#include "backends/cuda/stereo_steps.hpp"
#include "backends/cuda/stereo_windows.cuh"
#include "backends/cuda/vector_loads.cuh"

namespace defrec::cuda {
namespace {

constexpr int kRun = 4, kRuns = 8, kTile = kRun * kRuns, kRows = 4;  // samples
constexpr int kRunPixels = 2 * kRun, kTilePixels = 2 * kTile;
constexpr int kMoves = kRows - 1;  // of the columns' sums, from the first row to the last
constexpr int kMeet = kRunPixels - 1 + kGroup - 1;  // right pixels that a thread's samples meet
constexpr int kWindowRun = 4;                       // whose statistics a thread makes at once
constexpr int kMagic = 0x4b400000;  // the bits of 1.5 * 2^23: to them an integer below 2^22 is
                                    // added, and the float subtracted
constexpr int kInvalid = static_cast<int>(0x80000000);  // makes a key negative

constexpr int first_sample(int pixel) { return (pixel + 1) / 2 * 2; }
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

// Columns are of windows, others are samples on the left and pixels on the right. The right ones
// begin with what the first sample meets at the largest disparity.
template <int kRadius, int kGroups>
struct Search {
    static constexpr int kThreads = kRuns * kGroups;
    static constexpr int kSide = 2 * kRadius + 1, kWords = (kSide + 3) / 4;
    // Windows of an odd radius begin with the second row of a band.
    static constexpr int kSkipped = kRadius % 2,
                         kBandWords = (kSkipped + kSide + 2 * kMoves + 3) / 4;
    static constexpr int kUsed = kRunPixels - 1 + 2 * kRadius;  // columns of a thread's windows
    static constexpr int kLeftLine = padded(kUsed),
                         kRightLine = padded(kUsed + kGroup - 1);  // columns that a thread reads
    static constexpr int kReach = kTilePixels + kGroup * kGroups;
    static constexpr int kLeftColumns = kTilePixels - kRunPixels + kLeftLine,
                         kRightColumns =
                             kReach + std::max(kRightLine - kRunPixels - kGroup,
                                               padded(kWindowRun + 2 * kRadius) - kWindowRun);
    static constexpr int kBestStride = kRows * kTile + 4;
    static constexpr int kSamples = kRows * kTile,
                         kSampleRounds = (kSamples + kThreads - 1) / kThreads;
    // Bytes of the last word of a column's first window.
    static constexpr uint32_t kLastBytes = kSide % 4 == 1 ? 0xffu : 0xffffffu;
    static_assert(kSide % 4 == 1 || kSide % 4 == 3);

    struct Statistics {
        int left_sums[kRows][kLeftColumns], left_squares[kRows][kLeftColumns];
        // Above the sum of each right window, that of the rows that left since the first.
        int right_sums[kRows][kRightColumns], right_squares[kRows][kRightColumns];
    };
    struct alignas(16) Shared {
        // Rows of a column's first window, four in a word; and for each move a word whose dot
        // product with that of the other image is the products entering less those leaving, less
        // the right pixels that leave: l, l, ~l', ~l' and r, r, r', r'.
        int left[kWords + kMoves][kLeftColumns], right[kWords + kMoves][kRightColumns];
        float left_mean[kRows][kTile], left_root[kRows][kTile];
        // The bias is what is left to subtract from a window's products as a float.
        float right_sum[kRows][kReach], right_root[kRows][kReach], right_bias[kRows][kReach];
        int right_keys[kRows][4][kReach / 4];  // pixel i is at i % 4, i / 4
        union {
            Statistics columns;
            int best[kGroups][kBestStride];
        };
        Contest contests[kSamples];
        uint8_t textured[kRows][kTile];
    };
};

// Two rows from `row` on, in the lower half.
__device__ __forceinline__ uint32_t two_rows(const uint32_t* words, int row) {
    const uint32_t word = words[row / 4];
    return row % 4 == 3 ? __byte_perm(word, words[row / 4 + 1], 0x7743) & 0xffff
                        : word >> (8 * (row % 4)) & 0xffff;
}

// The memory that columns of an image go to: their words for the search, and sums and squares of
// their windows.
template <class S, int kColumns>
struct StagedColumns {
    int (&words)[S::kWords + kMoves][kColumns];
    int (&sums)[kRows][kColumns];
    int (&squares)[kRows][kColumns];
};

// A column of a band.
template <class S, bool kLeft, int kColumns>
__device__ __forceinline__ void stage_column(const StereoShape& shape, const uint32_t* image, int x,
                                             int band, int column,
                                             const StagedColumns<S, kColumns>& staged) {
    auto& [words, sums, squares] = staged;
    uint32_t rows[S::kBandWords + 1];
    // Outside the image some word is read that does not matter.
    const int last = (shape.half_height - 1) / kBandRows;
    const bool exists = x >= 0 && x < shape.half_width;
    const uint32_t* const at = image + clamped(x, 0, shape.half_width - 1);
#pragma unroll
    for (int q = 0; q < S::kBandWords; ++q)
        rows[q] = __ldg(at + min(band + q, last) * shape.half_stride);
#pragma unroll
    for (int q = 0; q < S::kBandWords; ++q)
        if (!exists || band + q > last) rows[q] = 0;
    rows[S::kBandWords] = 0;
    if (S::kSkipped != 0) {
#pragma unroll
        for (int q = 0; q < S::kBandWords; ++q)
            rows[q] = __funnelshift_r(rows[q], rows[q + 1], 8 * S::kSkipped);
    }
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
    int left = 0;  // sum of the rows that left
    sums[0][column] = sum;
    squares[0][column] = square;
#pragma unroll
    for (int move = 0; move < kMoves; ++move) {
        const uint32_t enters = two_rows(rows, S::kSide + 2 * move),
                       leaves = two_rows(rows, 2 * move) << 16;
        words[S::kWords + move][column] =
            static_cast<int>(kLeft ? enters | (leaves ^ 0xffff0000) : enters | leaves);
        const auto entering = static_cast<int>(enters), leaving = static_cast<int>(leaves);
        sum = __dp4a(static_cast<int>(enters | leaves), static_cast<int>(0xffff0101), sum);
        square = __dp4a(entering, entering, square) - __dp4a(leaving, leaving, 0);
        left = __dp4a(leaving, 0x01010101, left);
        sums[move + 1][column] = kLeft ? sum : sum + left * (1 << 16);
        squares[move + 1][column] = square;
    }
}

// The columns of both images that the block's windows have. left, right: the first pixels.
template <class S, int kRadius>
__device__ __forceinline__ void stage_columns(const SearchStep& step, typename S::Shared& shared,
                                              int left, int right, int band) {
    const StagedColumns<S, S::kLeftColumns> of_left{shared.left, shared.columns.left_sums,
                                                    shared.columns.left_squares};
    const StagedColumns<S, S::kRightColumns> of_right{shared.right, shared.columns.right_sums,
                                                      shared.columns.right_squares};
    for (int i = static_cast<int>(threadIdx.x); i < S::kLeftColumns + S::kRightColumns;
         i += S::kThreads) {
        const int j = i - S::kLeftColumns;
        if (j < 0)
            stage_column<S, true>(step.shape, step.left, left - kRadius + i, band, i, of_left);
        else
            stage_column<S, false>(step.shape, step.right, right - kRadius + j, band, j, of_right);
    }
}

// One row's windows from the sums along their columns, kStep columns apart.
template <int kRadius, int kStep, int kColumns>
__device__ __forceinline__ void window_run(const int (&columns)[kRows][kColumns], int row,
                                           int first, int (&sums)[kWindowRun]) {
    constexpr int kUsed = kStep * (kWindowRun - 1) + 1 + 2 * kRadius;
    int line[padded(kUsed)], used[kUsed];
    load_fours(&columns[row][first], line);
#pragma unroll
    for (int u = 0; u < kUsed; ++u) used[u] = line[u];
    sum_along<kRadius, kWindowRun, kStep>(used, sums);
}

__device__ __forceinline__ void store(float* to, const float (&values)[kWindowRun]) {
    *reinterpret_cast<float4*>(to) = make_float4(values[0], values[1], values[2], values[3]);
}

__device__ __forceinline__ float score_of(int key) { return __int_as_float(key & ~255); }

// What scores take from each window. left, right, top: the first pixels.
template <class S, int kRadius>
__device__ __forceinline__ void make_windows(const SearchStep& step, typename S::Shared& shared,
                                             int left, int right, int top) {
    const StereoShape& shape = step.shape;
    constexpr int kLeftRuns = kTile / kWindowRun, kWindowRuns = kLeftRuns + S::kReach / kWindowRun,
                  kPixelCount = S::kSide * S::kSide;
    for (int i = static_cast<int>(threadIdx.x); i < kRows * kWindowRuns; i += S::kThreads) {
        const int row = i / kWindowRuns, place = i % kWindowRuns, y = top + 2 * row;
        const bool of_left = place < kLeftRuns;
        const int at = (of_left ? place : place - kLeftRuns) * kWindowRun;
        int sums[kWindowRun], squares[kWindowRun];
        float sum[kWindowRun], root[kWindowRun], bias[kWindowRun];
        uint32_t textured = 0;
        if (of_left) {
            window_run<kRadius, 2>(shared.columns.left_sums, row, 2 * at, sums);
            window_run<kRadius, 2>(shared.columns.left_squares, row, 2 * at, squares);
        } else {
            window_run<kRadius, 1>(shared.columns.right_sums, row, at, sums);
            window_run<kRadius, 1>(shared.columns.right_squares, row, at, squares);
        }
#pragma unroll
        for (int m = 0; m < kWindowRun; ++m) {
            const int x = of_left ? left + 2 * (at + m) : right + at + m;
            const bool whole =
                x >= kRadius && x < shape.half_width - kRadius && y < shape.half_height - kRadius;
            const int total = static_cast<int16_t>(sums[m]), gone = (sums[m] - total) >> 16;
            const int variance = whole ? kPixelCount * squares[m] - total * total : 0;
            root[m] = inverse_root(variance);
            sum[m] = static_cast<float>(total) * (of_left ? shape.one_over_n : 1.0f);
            bias[m] = 0x1.8p23f - static_cast<float>(gone);
            textured |= variance >= shape.min_variance ? 1u << (8 * m) : 0u;
        }
        if (of_left) {
            store(&shared.left_mean[row][at], sum);
            store(&shared.left_root[row][at], root);
            *reinterpret_cast<uint32_t*>(&shared.textured[row][at]) = textured;
        } else {
            store(&shared.right_sum[row][at], sum);
            store(&shared.right_root[row][at], root);
            store(&shared.right_bias[row][at], bias);
        }
    }
}

// The part of a block that a thread has: one group at a time, for a run of samples in each row.
struct ThreadShare {
    int slot, run;
    int reach;  // the first right pixel that it meets
};
template <int kGroups>
__device__ __forceinline__ ThreadShare thread_share() {
    const int thread = static_cast<int>(threadIdx.x), slot = thread % kGroups,
              run = thread / kGroups;
    return {slot, run, kGroup * (kGroups - 1 - slot) + kRunPixels * run};
}

// Keys of the thread's samples in its four disparities. sums: along the columns.
template <class S, int kRadius>
__device__ __forceinline__ void score_row(typename S::Shared& shared, int row,
                                          const ThreadShare& share, const int (&tags)[kGroup],
                                          const int (&sums)[kGroup][S::kUsed]) {
    const int run = share.run, reach = share.reach;
    constexpr int kMet = padded(kMeet);
    float left_mean[kRun], left_root[kRun], right_sum[kMet], right_root[kMet], right_bias[kMet];
    load_fours(&shared.left_mean[row][kRun * run], left_mean);
    load_fours(&shared.left_root[row][kRun * run], left_root);
    load_fours(&shared.right_sum[row][reach], right_sum);
    load_fours(&shared.right_root[row][reach], right_root);
    load_fours(&shared.right_bias[row][reach], right_bias);
    int best[kRun], met[kMeet], window[kGroup];
#pragma unroll
    for (int i = 0; i < kMeet; ++i) met[i] = 0;
#pragma unroll
    for (int k = 0; k < kGroup; ++k) {
        window[k] = kMagic;
#pragma unroll
        for (int u = 0; u <= 2 * kRadius; ++u) window[k] += sums[k][u];
    }
#pragma unroll
    for (int m = 0; m < kRun; ++m) {
        best[m] = 0;
#pragma unroll
        for (int k = 0; k < kGroup; ++k) {
            const int i = 2 * m + kGroup - 1 - k;
            const float products = __int_as_float(window[k]) - right_bias[i];
            const float covariance = products - left_mean[m] * right_sum[i];
            const float score = covariance * (left_root[m] * right_root[i]);
            const int key = (__float_as_int(score) & ~255) | tags[k];
            best[m] = max(best[m], key);
            met[i] = max(met[i], key);
            if (m == kRun - 1) continue;
#pragma unroll
            for (int u = 2 * m; u < 2 * m + 2; ++u)
                window[k] += sums[k][u + 2 * kRadius + 1] - sums[k][u];
        }
    }
    *reinterpret_cast<int4*>(&shared.best[share.slot][row * kTile + kRun * run]) =
        make_int4(best[0], best[1], best[2], best[3]);
#pragma unroll
    for (int i = 0; i < kMeet; ++i)
        atomicMax(&shared.right_keys[row][i % 4][reach / 4 + i / 4], met[i]);
}

// Keys of the thread's samples in the disparities of its group, one of those from first_group on.
template <class S, int kRadius>
__device__ __forceinline__ void score_group(const StereoShape& shape, typename S::Shared& shared,
                                            const ThreadShare& share, int first_group) {
    // The group's disparities; those after the last have keys that never win.
    int tags[kGroup];
#pragma unroll
    for (int k = 0; k < kGroup; ++k) {
        const int index = kGroup * (first_group + share.slot) + k;
        tags[k] = index < shape.count ? index : kInvalid;
    }
    int sums[kGroup][S::kUsed];
#pragma unroll
    for (int k = 0; k < kGroup; ++k)
#pragma unroll
        for (int u = 0; u < S::kUsed; ++u) sums[k][u] = 0;
    const auto add_products = [&](int word) {
        int left_words[S::kLeftLine], right_words[S::kRightLine];
        load_fours(&shared.left[word][kRunPixels * share.run], left_words);
        load_fours(&shared.right[word][share.reach], right_words);
#pragma unroll
        for (int k = 0; k < kGroup; ++k)
#pragma unroll
            for (int u = 0; u < S::kUsed; ++u)
                sums[k][u] = __dp4a(left_words[u], right_words[u + kGroup - 1 - k], sums[k][u]);
    };
#pragma unroll
    for (int word = 0; word < S::kWords; ++word) add_products(word);
#pragma unroll 1
    for (int row = 0;; ++row) {
        score_row<S, kRadius>(shared, row, share, tags, sums);
        if (row == kRows - 1) break;
        add_products(S::kWords + row);
    }
}

// The best of `count` groups from first_group on enter the contests of the samples.
template <class S>
__device__ __forceinline__ void enter_groups(typename S::Shared& shared, int first_group,
                                             int count) {
#pragma unroll
    for (int round = 0; round < S::kSampleRounds; ++round) {
        const int sample = static_cast<int>(threadIdx.x) + round * S::kThreads;
        if (sample >= S::kSamples) break;
        Contest contest{0, 0, 0, 0};
        if (first_group > 0) contest = shared.contests[sample];
#pragma unroll 4
        for (int g = 0; g < count; ++g) contest.enter(first_group + g, shared.best[g][sample]);
        shared.contests[sample] = contest;
    }
}

// The keys of the right pixels, of which (right, top) is the first, enter those of all blocks.
template <class S>
__device__ __forceinline__ void give_right_keys(const SearchStep& step,
                                                const typename S::Shared& shared, int right,
                                                int top) {
    for (int i = static_cast<int>(threadIdx.x); i < kRows * S::kReach; i += S::kThreads) {
        const int row = i / S::kReach, at = i % S::kReach,
                  key = shared.right_keys[row][at % 4][at / 4];
        // A key of 255 or less has the score 0.
        if (key > 255)
            atomicMax(&step.right_keys[(top / 2 + row) * step.shape.half_width + right + at], key);
    }
}

// The winners of the samples' contests, where they pass what is asked of a left pixel alone.
template <class S, int kRadius>
__device__ __forceinline__ void give_candidates(const SearchStep& step,
                                                const typename S::Shared& shared, int left,
                                                int top) {
    const StereoShape& shape = step.shape;
#pragma unroll
    for (int round = 0; round < S::kSampleRounds; ++round) {
        const int sample = static_cast<int>(threadIdx.x) + round * S::kThreads;
        if (sample >= S::kSamples) break;
        const int i = left / 2 + sample % kTile, j = top / 2 + sample / kTile;
        if (2 * i >= shape.half_width - kRadius || 2 * j >= shape.half_height - kRadius) continue;
        const Contest& contest = shared.contests[sample];
        const int key = contest.winner > 255 ? contest.winner : 0;
        const float lead = score_of(key) - score_of(contest.second);
        const bool good = key != 0 && score_of(key) >= shape.min_score && lead >= shape.min_lead &&
                          shared.textured[sample / kTile][sample % kTile] != 0;
        const int at = j * shape.half_samples_x + i;
        step.candidates[at] = static_cast<uint16_t>(good ? 1 + (key & 255) : 0);
        if (step.left_keys != nullptr) step.left_keys[at] = key;
    }
}

template <int kRadius, int kGroups>
__global__ void __launch_bounds__(kRuns* kGroups, 512 / (kRuns * kGroups)) search(SearchStep step) {
    using S = Search<kRadius, kGroups>;
    __shared__ typename S::Shared shared;
    const StereoShape& shape = step.shape;
    const ThreadShare share = thread_share<kGroups>();
    // Pixels of the first sample; and the band in which its window begins.
    const int left =
        first_sample(kRadius + shape.first) + static_cast<int>(blockIdx.x) * kTilePixels;
    const int top = first_sample(kRadius) + static_cast<int>(blockIdx.y) * 2 * kRows,
              band = (top - kRadius) / kBandRows;
    const int groups = (shape.count + kGroup - 1) / kGroup;
    for (int first_group = 0; first_group < groups; first_group += kGroups) {
        const int right = left - shape.first - kGroup * (first_group + kGroups - 1) - (kGroup - 1);
        stage_columns<S, kRadius>(step, shared, left, right, band);
        for (int i = static_cast<int>(threadIdx.x); i < kRows * S::kReach; i += S::kThreads)
            (&shared.right_keys[0][0][0])[i] = 0;
        __syncthreads();
        make_windows<S, kRadius>(step, shared, left, right, top);
        __syncthreads();
        score_group<S, kRadius>(shape, shared, share, first_group);
        __syncthreads();
        enter_groups<S>(shared, first_group, min(kGroups, groups - first_group));
        give_right_keys<S>(step, shared, right, top);
        __syncthreads();
    }
    give_candidates<S, kRadius>(step, shared, left, top);
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
    // Pixels from the first to the last that has a window.
    const int columns = shape.half_width - shape.radius - first_sample(shape.radius + shape.first),
              rows = shape.half_height - shape.radius - first_sample(shape.radius);
    if (columns <= 0 || rows <= 0) return;
    const dim3 blocks(cover(static_cast<uint32_t>(columns), kTilePixels),
                      cover(static_cast<uint32_t>(rows), 2 * kRows));
    // In as few rounds of up to 16 groups as there may be, and no more at a time than they need.
    const uint32_t groups = cover(static_cast<uint32_t>(shape.count), kGroup),
                   at_a_time = cover(groups, cover(groups, 16));
    if (at_a_time <= 8)
        record_with<8>(recorder, step, blocks);
    else if (at_a_time <= 12)
        record_with<12>(recorder, step, blocks);
    else
        record_with<16>(recorder, step, blocks);
}

}  // namespace defrec::cuda
