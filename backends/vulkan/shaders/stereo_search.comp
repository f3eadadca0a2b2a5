// Stage stereo, section 3: the search. A work group has a tile of 48 x 32 left pixels and goes
// through the disparities in groups of four, some groups at once. First its invocations sum the
// products along the columns of the windows, each for two columns and two disparities; then each
// adds up the columns for some samples of a row and scores them. The right pixels that these meet
// move on by one sample from every second disparity to the next, and so do their best keys.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
const int kTileWidth = 48, kTileHeight = 32, kRows = kTileHeight / 2;
const int kRun = 3;    // samples of an invocation
const int kSteps = 8;  // disparities at once
layout(local_size_x = kRows, local_size_y = kTileWidth / 2 / kRun) in;

layout(constant_id = 0) const int kRadius = 4;
layout(std430, set = 0, binding = 0) readonly buffer LeftWords { int left_words[]; };
layout(std430, set = 0, binding = 1) readonly buffer RightWords { int right_words[]; };
layout(std430, set = 0, binding = 2) readonly buffer LeftStatistics { vec2 left_statistics[]; };
layout(std430, set = 0, binding = 3) readonly buffer RightStatistics {
    int64_t right_statistics[];
};  // two floats
layout(std430, set = 0, binding = 4) writeonly buffer Candidates { uint16_t candidates[]; };
layout(std430, set = 0, binding = 5) buffer RightKeys { int right_keys[]; };
layout(std430, set = 0, binding = 6) writeonly buffer LeftKeys { int left_keys[]; };

// The windows of sample s are the pairs of columns s to s + kRadius - 1 and the first column of the
// pair after, the first pair beginning at column -kRadius of the tile.
const int kPairs = kTileWidth / 2 + kRadius;

// Sums along columns, of the even rows: of both columns of a pair, and of its first one; together,
// because lavapipe takes as long for 32 bits as for 64.
shared int64_t columns[kSteps][kPairs][kRows + 1];

// An invocation's samples.
#define Ints ivec3
#define Floats vec3
#define Bools bvec3
Ints moved_on(int entering, Ints values) { return Ints(entering, values.xy); }
Floats moved_on(float entering, Floats values) { return Floats(entering, values.xy); }

int left_word(int x, int q) {
    const bool inside = x >= 0 && x < push.half_width && q >= 0 && q < words_of(push.half_height);
    return inside ? left_words[q * push.half_width + x] : 0;
}
int right_word(int x, int q) {
    const bool inside = x >= 0 && x < push.half_width && q >= 0 && q < words_of(push.half_height);
    return inside ? right_words[q * push.half_width + x] : 0;
}

// The first of the two columns that the invocation sums along.
int first_column() {
    return int(gl_WorkGroupID.x) * kTileWidth - kRadius +
           2 * (int(gl_LocalInvocationIndex) % kPairs);
}

// The words of the tile's columns with windows, from the one with the first row of a window on.
const int kWordsBefore = (kRadius + 3) / 4, kWords = kWordsBefore + (kTileHeight + kRadius + 2) / 4;

// Sums for the disparities from first_index on. left: the words of the invocation's two columns.
void sum_columns(int first_index, ivec2 left[kWords]) {
    const int i = int(gl_LocalInvocationIndex);
    if (i >= kPairs * (kSteps / 2)) return;
    const int p = i % kPairs, k = i / kPairs * 2, x = first_column(),
              q0 = int(gl_WorkGroupID.y) * (kTileHeight / 4) - kWordsBefore,
              d = push.first + first_index + k;
    // Products of the pair at disparity d and at d + 1, then likewise those of its first column.
    ivec4 products[kTileHeight + 2 * kRadius];
    ivec4 sum = ivec4(0);
    ivec3 right;
    [[unroll]] for (int v = 0; v < kTileHeight + 2 * kRadius - 1; ++v) {
        const int row = v - kRadius + 4 * kWordsBefore;
        if (v == 0 || (row & 3) == 0) {
            const int q = q0 + row / 4;
            right = ivec3(right_word(x - d - 1, q), right_word(x - d, q), right_word(x - d + 1, q));
        }
        const int up = 24 - 8 * (row & 3);
        const ivec2 l = (left[row / 4] << up) >> 24;
        const ivec3 r = (right << up) >> 24;
        const ivec2 first = l.x * r.yx;
        products[v] = ivec4(first + l.y * r.zy, first);
        sum += products[v];
        if (v < 2 * kRadius) continue;
        if ((v & 1) == 0) {
            const int j = (v - 2 * kRadius) / 2;
            columns[k][p][j] = packInt2x32(sum.xz);
            columns[k + 1][p][j] = packInt2x32(sum.yw);
        }
        sum -= products[v - 2 * kRadius];
    }
}

// The words of the invocation's two columns.
void load_left(out ivec2 left[kWords]) {
    [[unroll]] for (int w = 0; w < kWords; ++w) {
        const int x = first_column(),
                  q = int(gl_WorkGroupID.y) * (kTileHeight / 4) - kWordsBefore + w;
        left[w] = ivec2(left_word(x, q), left_word(x + 1, q));
    }
}

// The windows of the invocation's samples.
Ints sum_windows(int k, int first, int j) {
    ivec2 line[kRun + kRadius];
    int sum = 0;
    [[unroll]] for (int u = 0; u < kRun + kRadius; ++u) line[u] =
        unpackInt2x32(columns[k][first + u][j]);
    [[unroll]] for (int u = 0; u < kRadius; ++u) sum += line[u].x;
    Ints sums;
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        sums[m] = sum + line[m + kRadius].y;
        sum += line[m + kRadius].x - line[m].x;
    }
    return sums;
}

vec2 right_statistics_at(int x, int j) {
    return x >= 0 && x < push.half_width && j < push.half_samples_y
               ? intBitsToFloat(unpackInt2x32(right_statistics[j * push.half_width + x]))
               : vec2(0.0);
}

void offer_right(int x, int j, int key) {
    if (key > 0 && x >= 0 && x < push.half_width && j < push.half_samples_y)
        atomicMax(right_keys[j * push.half_width + x], key);
}

// Statistics of the samples, and of the right pixels that even and odd indices meet: those of two
// disparities before.
struct Statistics {
    Floats left_mean, left_root, right_sum[2], right_root[2];
};

// Row j from sample `first` on.
Statistics load_statistics(int first, int j) {
    Statistics s;
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        const vec2 left = first + m < push.half_samples_x && j < push.half_samples_y
                              ? left_statistics[j * push.half_samples_x + first + m]
                              : vec2(0.0);
        s.left_mean[m] = left.x;
        s.left_root[m] = left.y;
        [[unroll]] for (int c = 0; c < 2; ++c) {
            const vec2 right = right_statistics_at(2 * (first + m + 1) - push.first - c, j);
            s.right_sum[c][m] = right.x;
            s.right_root[c][m] = right.y;
        }
    }
    return s;
}

Ints scored(Floats sums, Statistics s, int c, int index) {
    precise const Floats expected = s.left_mean * s.right_sum[c];
    precise const Floats covariance = sums - expected;
    precise const Floats roots = s.left_root * s.right_root[c];
    precise const Floats score = covariance * roots;
    return mix(Ints(0), (floatBitsToInt(score) & ~255) | index, greaterThan(score, Floats(0.0)));
}

// The winners, and the second, as the groups come in ascending order.
struct Contest {
    Ints winner, second;
    Ints last_best, before;  // keys of the last group, and of all before it
};
void enter(inout Contest contest, int group, Ints best) {
    const Bools wins = greaterThan(best, contest.winner);
    const Bools apart = greaterThan(group - ((contest.winner & 255) >> 2), Ints(1));
    contest.second =
        mix(mix(contest.second, max(contest.second, best), apart), contest.before, wins);
    contest.winner = max(contest.winner, best);
    contest.before = max(contest.before, contest.last_best);
    contest.last_best = best;
}

void main() {
    const ivec2 place = ivec2(kRun * gl_LocalInvocationID.y, gl_LocalInvocationID.x),
                at = ivec2(gl_WorkGroupID.xy) * ivec2(kTileWidth / 2, kRows) + place;
    const int first = at.x, j = at.y;

    Statistics statistics = load_statistics(first, j);
    Ints right_best[2] = Ints[](Ints(0), Ints(0));
    Contest contest = Contest(Ints(0), Ints(0), Ints(0), Ints(0));
    ivec2 left_columns[kWords];
    load_left(left_columns);

    // Not `for`: lavapipe goes through its body once more, for nobody.
    int first_index = 0;
    do {
        vec2 right[kSteps];  // loaded here, because what is between hides how long it takes
        [[unroll]] for (int k = 0; k < kSteps; ++k) right[k] =
            right_statistics_at(2 * first - push.first - first_index - k, j);
        sum_columns(first_index, left_columns);
        barrier();
        [[unroll]] for (int g = 0; g < kSteps; g += kGroup) {
            Ints best = Ints(0);
            [[unroll]] for (int k = g; k < g + kGroup; ++k) {
                const int index = first_index + k, d = push.first + index, c = k & 1;
                if (index >= push.count) continue;
                offer_right(2 * (first + kRun) - d, j, right_best[c][kRun - 1]);
                statistics.right_sum[c] = moved_on(right[k].x, statistics.right_sum[c]);
                statistics.right_root[c] = moved_on(right[k].y, statistics.right_root[c]);
                const Ints sums = sum_windows(k, place.x, place.y);
                const Ints key = scored(Floats(sums), statistics, c, index);
                best = max(best, key);
                right_best[c] = max(moved_on(0, right_best[c]), key);
            }
            enter(contest, (first_index + g) / kGroup, best);
        }
        barrier();
        first_index += kSteps;
    } while (first_index < push.count);

    if (j >= push.half_samples_y) return;
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        [[unroll]] for (int c = 0; c < 2; ++c) {
            const int last = push.count - 1 - ((push.count - 1 + c) & 1);
            offer_right(2 * (first + m) - push.first - last, j, right_best[c][m]);
        }
        if (first + m >= push.half_samples_x) continue;
        const int at = j * push.half_samples_x + first + m;
        candidates[at] = uint16_t(candidate_of(contest.winner[m], contest.second[m]));
        if (is_given(kOutLeftKeys)) left_keys[at] = contest.winner[m];
    }
}
