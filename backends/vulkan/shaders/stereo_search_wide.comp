// Stage stereo, section 3 and what section 4 asks of a left pixel alone, as stereo_statistics.comp
// and stereo_search.comp, for devices that run many invocations at once. A work group has a tile of
// 32 x 4 left samples and goes through the disparities kSlots groups of four at a time. An
// invocation has one group for four samples in each row: it keeps the sums of products along the
// columns of their windows in registers and moves them down from row to row. Groups meet in shared
// memory. It takes the products of four bytes in one instruction.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_spirv_intrinsics : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(constant_id = 0) const int kRadius = 4;
layout(constant_id = 1) const int kSlots = 16;
layout(local_size_x_id = 2) in;  // kInvocations

layout(std430, set = 0, binding = 0) readonly buffer LeftWords { int left_words[]; };
layout(std430, set = 0, binding = 1) readonly buffer RightWords { int right_words[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Candidates { uint16_t candidates[]; };
layout(std430, set = 0, binding = 3) buffer RightKeys { int right_keys[]; };
layout(std430, set = 0, binding = 4) writeonly buffer LeftKeys { int left_keys[]; };

const int kRun = kWideSearchRun, kRuns = kWideSearchTile / kRun;
const int kRows = kWideSearchRows, kInvocations = kRuns * kSlots,
          kSamples = kWideSearchTile * kRows,
          kSampleRounds = (kSamples + kInvocations - 1) / kInvocations;
const int kSide = 2 * kRadius + 1, kBand = kSide + 2 * (kRows - 1);  // rows of the windows
const int kSkipped = kRadius & 1;  // rows of the first column word before them
const int kBandWords = (kSkipped + kBand + 3) / 4, kRowWords = kBandWords + 1;
const int kMoves = kRows - 1, kWords = (kSide + 3) / 4;
const int kLastBytes = kSide % 4 == 1 ? 0xff : 0xffffff;  // of the last word of a column's window
const int kMagic = 0x4b400000;  // the bits of 1.5 * 2^23: an integer below 2^22 added to them is
                                // added to the float
const int kMet = (2 * kRun - 1 + kGroup - 1 + 3) / 4;  // right pixels of an invocation, in fours
const int kUsed = 2 * kRun - 1 + 2 * kRadius;          // columns of an invocation's left windows
// These and those of its right windows, in fours; and the columns of four windows side by side.
const int kLeftLine = (kUsed + 3) / 4, kRightLine = (kUsed + kGroup - 1 + 3) / 4,
          kWindowLine = (4 + 2 * kRadius + 3) / 4;
// Right pixels of the tile. The first is what its first sample meets at the largest disparity.
const int kReach = 2 * kWideSearchTile + kGroup * kSlots;
// Columns in fours, left ones and then right ones.
const int kLeftFours = kWideSearchTile / 2 - kRun / 2 + kLeftLine,
          kFurther = kRightLine - 3 > kWindowLine - 1 ? kRightLine - 3 : kWindowLine - 1,
          kFours = kLeftFours + kReach / 4 + kFurther;

// Rows of a column's first window, four in a word; and for each move down by two rows a word whose
// dot product with that of the other image is the products entering less those leaving, less the
// right pixels that leave: l, l, ~l', ~l' and r, r, r', r'.
shared ivec4 words[kWords + kMoves][kFours];
shared vec4 left_mean[kRows][kRuns], left_root[kRows][kRuns];
shared vec4 right_sum[kRows][kReach / 4], right_root[kRows][kReach / 4];
// What is left to subtract from a window's products as a float, for the right pixels that left.
shared vec4 right_bias[kRows][kReach / 4];
shared uint textured[kRows][kRuns];           // bits of samples
shared int right_best[kRows][4][kReach / 4];  // of pixel i at i % 4, i / 4
// First sums and squares along the columns of each row's windows, and above the sums of right
// columns those of what left; then the best keys of each group.
const int kBestFours = kSamples / 4 + 1;
const int kSumFours = 2 * kRows * kFours,
          kScratch = kSumFours > kSlots *kBestFours ? kSumFours : kSlots *kBestFours;
shared ivec4 scratch[kScratch];

struct Contest {
    int winner, second;
    int last, before;  // the best keys of the group before, and of all before that
};

spirv_instruction(extensions = ["SPV_KHR_integer_dot_product"], capabilities = [ 6018, 6019 ],
                  id = 4450) int packed_dot(int a, int b, spirv_literal int format);

int dot4(int a, int b) { return packed_dot(a, b, 0); }

// Two rows from `row` on, in the lower half.
int two_rows(int rows[kRowWords], int row) {
    const int word = rows[row / 4];
    return row % 4 == 3 ? (word >> 24 & 0xff) | (rows[row / 4 + 1] & 0xff) << 8
                        : word >> (8 * (row % 4)) & 0xffff;
}

// left, right, top: the tile's first pixels.
void load_columns(int me, int left, int right, int top) {
    for (int i = me; i < 4 * kFours; i += kInvocations) {
        const bool of_left = i < 4 * kLeftFours;
        const int x = (of_left ? left + i : right + i - 4 * kLeftFours) - kRadius,
                  q = (top - kRadius) / 4, last = words_of(push.half_height) - 1;
        const bool exists = x >= 0 && x < push.half_width;
        int rows[kRowWords];
        const int at = clamp(x, 0, push.half_width - 1);
        if (of_left) {
            [[unroll]] for (int w = 0; w < kBandWords; ++w) rows[w] =
                left_words[min(q + w, last) * push.half_width + at];
        } else {
            [[unroll]] for (int w = 0; w < kBandWords; ++w) rows[w] =
                right_words[min(q + w, last) * push.half_width + at];
        }
        [[unroll]] for (int w = 0; w < kBandWords; ++w) if (!exists || q + w > last) rows[w] = 0;
        rows[kBandWords] = 0;
        if (kSkipped != 0) [[unroll]]
            for (int w = 0; w < kBandWords; ++w)
                rows[w] = (rows[w] >> 8 & 0xffffff) | rows[w + 1] << 24;
        const int four = i >> 2, k = i & 3;
        int sum = 0, squares = 0, gone = 0;
        [[unroll]] for (int w = 0; w < kWords; ++w) {
            const int inside = w == kWords - 1 ? rows[w] & kLastBytes : rows[w];
            sum += dot4(inside, 0x01010101);
            squares += dot4(inside, inside);
            words[w][four][k] = of_left ? inside : rows[w];
        }
        scratch[four][k] = sum;
        scratch[kRows * kFours + four][k] = squares;
        [[unroll]] for (int move = 0; move < kMoves; ++move) {
            const int enter = two_rows(rows, kSide + 2 * move), leave = two_rows(rows, 2 * move)
                                                                        << 16;
            words[kWords + move][four][k] = enter | (of_left ? leave ^ int(0xffff0000) : leave);
            sum += dot4(enter | leave, int(0xffff0101));
            squares += dot4(enter, enter) - dot4(leave, leave);
            gone += dot4(leave, 0x01010101);
            scratch[(move + 1) * kFours + four][k] = of_left ? sum : sum + gone * (1 << 16);
            scratch[(kRows + move + 1) * kFours + four][k] = squares;
        }
    }
}

// Sums of four windows, `apart` columns from one to the next, of which the first begins with column
// 4 * first.
ivec4 sum_windows(int row, int first, int apart, int fours) {
    int line[4 * kLeftLine];
    [[unroll]] for (int f = 0; f < kLeftLine; ++f) {
        const ivec4 four = f < fours ? scratch[row * kFours + first + f] : ivec4(0);
        [[unroll]] for (int k = 0; k < 4; ++k) line[4 * f + k] = four[k];
    }
    int sum = 0;
    ivec4 sums;
    [[unroll]] for (int u = 0; u < kSide; ++u) sum += line[u];
    [[unroll]] for (int m = 0; m < 4; ++m) {
        sums[m] = sum;
        if (m == 3) break;
        [[unroll]] for (int u = apart * m; u < apart * (m + 1); ++u) sum +=
            line[u + kSide] - line[u];
    }
    return sums;
}

void make_windows(int me, int left, int right, int top) {
    const int n = kSide * kSide, runs = kRuns + kReach / 4;
    for (int i = me; i < kRows * runs; i += kInvocations) {
        const int row = i / runs, place = i % runs, y = top + 2 * row;
        const bool of_left = place < kRuns;
        ivec4 sums, squares;
        if (of_left) {
            sums = sum_windows(row, 2 * place, 2, kLeftLine);
            squares = sum_windows(kRows + row, 2 * place, 2, kLeftLine);
        } else {
            sums = sum_windows(row, kLeftFours + place - kRuns, 1, kWindowLine);
            squares = sum_windows(kRows + row, kLeftFours + place - kRuns, 1, kWindowLine);
        }
        const ivec4 gone = (sums - ((sums << 16) >> 16)) >> 16;
        sums = (sums << 16) >> 16;
        vec4 root;
        uint with_texture = 0u;
        [[unroll]] for (int m = 0; m < 4; ++m) {
            const int x = of_left ? left + 2 * (4 * place + m) : right + 4 * (place - kRuns) + m;
            const bool whole =
                x >= kRadius && x < push.half_width - kRadius && y < push.half_height - kRadius;
            const int variance = whole ? n * squares[m] - sums[m] * sums[m] : 0;
            root[m] = inverse_root(variance);
            with_texture |= (variance >= push.min_variance ? 1u : 0u) << m;
        }
        if (of_left) {
            precise const vec4 mean = vec4(sums) * push.one_over_n;
            left_mean[row][place] = mean;
            left_root[row][place] = root;
            textured[row][place] = with_texture;
        } else {
            right_sum[row][place - kRuns] = vec4(sums);
            right_root[row][place - kRuns] = root;
            right_bias[row][place - kRuns] = intBitsToFloat(kMagic) - vec4(gone);
        }
    }
}

// The invocation's.
int products[kGroup][kUsed];  // sums along the columns of its windows, for each disparity
int tags[kGroup];             // index of each disparity; negative after the last

void add_products(int word, int first_left, int first_right) {
    int left[4 * kLeftLine], right[4 * kRightLine];
    [[unroll]] for (int f = 0; f < kLeftLine; ++f) {
        const ivec4 four = words[word][first_left + f];
        [[unroll]] for (int k = 0; k < 4; ++k) left[4 * f + k] = four[k];
    }
    [[unroll]] for (int f = 0; f < kRightLine; ++f) {
        const ivec4 four = words[word][first_right + f];
        [[unroll]] for (int k = 0; k < 4; ++k) right[4 * f + k] = four[k];
    }
    [[unroll]] for (int k = 0; k < kGroup; ++k) [[unroll]] for (int u = 0; u < kUsed; ++u)
        products[k][u] += dot4(left[u], right[u + kGroup - 1 - k]);
}

void score_row(int row, int slot, int run, int first_met) {
    const vec4 mean = left_mean[row][run], root = left_root[row][run];
    float met_sum[4 * kMet], met_root[4 * kMet], met_bias[4 * kMet];
    int met[4 * kMet];
    [[unroll]] for (int f = 0; f < kMet; ++f) {
        const vec4 sums = right_sum[row][first_met + f], roots = right_root[row][first_met + f],
                   bias = right_bias[row][first_met + f];
        [[unroll]] for (int k = 0; k < 4; ++k) {
            met_sum[4 * f + k] = sums[k];
            met_root[4 * f + k] = roots[k];
            met_bias[4 * f + k] = bias[k];
            met[4 * f + k] = 0;
        }
    }
    int window[kGroup];
    [[unroll]] for (int k = 0; k < kGroup; ++k) {
        window[k] = kMagic;
        [[unroll]] for (int u = 0; u < kSide; ++u) window[k] += products[k][u];
    }
    ivec4 best = ivec4(0);
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        [[unroll]] for (int k = 0; k < kGroup; ++k) {
            const int i = 2 * m + kGroup - 1 - k;
            precise const float expected = mean[m] * met_sum[i];
            precise const float sum = intBitsToFloat(window[k]) - met_bias[i];
            precise const float covariance = sum - expected;
            precise const float roots = root[m] * met_root[i];
            precise const float result = covariance * roots;
            const int key = (floatBitsToInt(result) & ~255) | tags[k];
            best[m] = max(best[m], key);
            met[i] = max(met[i], key);
            if (m < kRun - 1) [[unroll]]
                for (int u = 2 * m; u < 2 * m + 2; ++u)
                    window[k] += products[k][u + kSide] - products[k][u];
        }
    }
    scratch[slot * kBestFours + row * kRuns + run] = best;
    [[unroll]] for (int i = 0; i < 2 * kRun - 1 + kGroup - 1; ++i)
        atomicMax(right_best[row][i & 3][first_met + (i >> 2)], met[i]);
}

void search(int slot, int run, int first_group) {
    const int first_met = kSlots - 1 - slot + 2 * run, first_left = 2 * run,
              first_right = kLeftFours + first_met;
    [[unroll]] for (int k = 0; k < kGroup; ++k) {
        const int index = kGroup * (first_group + slot) + k;
        tags[k] = index < push.count ? index : int(0x80000000);
        [[unroll]] for (int u = 0; u < kUsed; ++u) products[k][u] = 0;
    }
    for (int word = 0; word < kWords + kMoves; ++word) {
        add_products(word, first_left, first_right);
        if (word >= kWords - 1) score_row(word - (kWords - 1), slot, run, first_met);
    }
}

void enter(inout Contest contest, int group, int best) {
    if (best > contest.winner) {
        contest.second = contest.before;
        contest.winner = best;
    } else if (group - (contest.winner & 255) / kGroup > 1) {
        contest.second = max(contest.second, best);
    }
    contest.before = max(contest.before, contest.last);
    contest.last = best;
}

void main() {
    const int me = int(gl_LocalInvocationIndex), slot = me % kSlots, run = me / kSlots;
    const int left =
                  (kRadius + push.first + 1) / 2 * 2 + int(gl_WorkGroupID.x) * 2 * kWideSearchTile,
              top = (kRadius + 1) / 2 * 2 + int(gl_WorkGroupID.y) * 2 * kRows;
    const int groups = (push.count + kGroup - 1) / kGroup;
    Contest contests[kSampleRounds];
    [[unroll]] for (int t = 0; t < kSampleRounds; ++t) contests[t] = Contest(0, 0, 0, 0);
    for (int first_group = 0; first_group < groups; first_group += kSlots) {
        const int right = left - push.first - kGroup * (first_group + kSlots) + 1;
        load_columns(me, left, right, top);
        for (int i = me; i < kRows * kReach; i += kInvocations)
            right_best[i / kReach][i & 3][i % kReach >> 2] = 0;
        barrier();
        make_windows(me, left, right, top);
        barrier();
        search(slot, run, first_group);
        barrier();
        [[unroll]] for (int t = 0; t < kSampleRounds; ++t) {
            const int i = me + t * kInvocations;
            if (i >= kSamples) continue;
            for (int g = 0; g < min(kSlots, groups - first_group); ++g)
                enter(contests[t], first_group + g, scratch[g * kBestFours + (i >> 2)][i & 3]);
        }
        for (int i = me; i < kRows * kReach; i += kInvocations) {
            const int row = i / kReach, at = i % kReach, key = right_best[row][at & 3][at >> 2];
            if (key > 255)  // else its score is 0
                atomicMax(right_keys[(top / 2 + row) * push.half_width + right + at], key);
        }
        barrier();
    }
    [[unroll]] for (int t = 0; t < kSampleRounds; ++t) {
        const int sample_at = me + t * kInvocations, i = left / 2 + sample_at % kWideSearchTile,
                  row = sample_at / kWideSearchTile, j = top / 2 + row;
        if (sample_at >= kSamples || 2 * i >= push.half_width - kRadius ||
            2 * j >= push.half_height - kRadius)
            continue;
        const int key = contests[t].winner > 255 ? contests[t].winner : 0;
        const uint with_texture = textured[row][sample_at % kWideSearchTile / 4] >> (sample_at & 3);
        const int at = j * push.half_samples_x + i;
        candidates[at] =
            uint16_t((with_texture & 1u) != 0u ? candidate_of(key, contests[t].second) : 0);
        if (is_given(kOutLeftKeys)) left_keys[at] = key;
    }
}
