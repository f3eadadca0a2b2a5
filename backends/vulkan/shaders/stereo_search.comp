// Stage stereo, section 3: the search. A work group has a tile of 32 x 32 left pixels and goes
// through the disparities in groups of four. Half of its invocations sum the products of a group
// along the columns of the windows, while the other half add up the columns of the group before,
// each for four samples of a row, and score them. The right pixels that these four meet move on by
// one sample from every second disparity to the next, and so do their best keys.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
const int kScorers = 64, kSummers = 64;
layout(local_size_x = kScorers + kSummers) in;

layout(constant_id = 0) const int kRadius = 4;
layout(std430, set = 0, binding = 0) readonly buffer LeftWords { int left_words[]; };
layout(std430, set = 0, binding = 1) readonly buffer RightWords { int right_words[]; };
layout(std430, set = 0, binding = 2) readonly buffer LeftStatistics { vec2 left_statistics[]; };
layout(std430, set = 0, binding = 3) readonly buffer RightStatistics { vec2 right_statistics[]; };
layout(std430, set = 0, binding = 4) writeonly buffer LeftKeys { int left_keys[]; };
layout(std430, set = 0, binding = 5) writeonly buffer Seconds { int seconds[]; };
layout(std430, set = 0, binding = 6) buffer RightKeys { int right_keys[]; };

const int kTile = 32, kSamples = kTile / 2;
// The windows of sample s are the pairs of columns s to s + kRadius - 1 and the first column of the
// pair after, the first pair beginning at column -kRadius of the tile.
const int kPairs = kSamples + kRadius;
const int kRun = 4;  // samples of an invocation

// Sums along columns, of the even rows: of both columns of a pair, and of its first one. Of two
// groups of disparities in turn.
shared int pairs[2][kGroup][kPairs][kSamples + 1];
shared int singles[2][kGroup][kPairs][kSamples + 1];

int word_at(bool left, int x, int q) {
    if (x < 0 || x >= push.half_width || q < 0 || q >= words_of(push.half_height)) return 0;
    return left ? left_words[q * push.half_width + x] : right_words[q * push.half_width + x];
}

void sum_columns(int group, int me) {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    for (int i = me; i < 2 * kPairs; i += kSummers) {
        const int p = i % kPairs, k = i / kPairs * 2, x = tile.x - kRadius + 2 * p,
                  d = push.first + group * kGroup + k;
        // Of disparity d: the pair's product and its first column's; of d + 1 likewise.
        ivec4 products[kTile + 2 * kRadius];
        ivec4 sum = ivec4(0);
        ivec2 left;
        ivec3 right;
        [[unroll]] for (int v = 0; v < kTile + 2 * kRadius - 1; ++v) {
            const int row = v - kRadius;
            if (v == 0 || (row & 3) == 0) {
                const int q = (tile.y >> 2) + (row >> 2);
                left = ivec2(word_at(true, x, q), word_at(true, x + 1, q));
                right = ivec3(word_at(false, x - d - 1, q), word_at(false, x - d, q),
                              word_at(false, x - d + 1, q));
            }
            const int up = 24 - 8 * (row & 3);
            const ivec2 l = (left << up) >> 24;
            const ivec3 r = (right << up) >> 24;
            const ivec2 first = l.x * r.yx;
            products[v] = ivec4(first + l.y * r.zy, first);
            sum += products[v];
            if (v < 2 * kRadius) continue;
            if ((v & 1) == 0) {
                const int j = (v - 2 * kRadius) / 2;
                pairs[group & 1][k][p][j] = sum.x;
                pairs[group & 1][k + 1][p][j] = sum.y;
                singles[group & 1][k][p][j] = sum.z;
                singles[group & 1][k + 1][p][j] = sum.w;
            }
            sum -= products[v - 2 * kRadius];
        }
    }
}

// The windows of the invocation's samples.
ivec4 sum_windows(int group, int k, int first, int j) {
    int line[kRun + kRadius - 1], sum = 0;
    [[unroll]] for (int u = 0; u < kRun + kRadius - 1; ++u) line[u] =
        pairs[group & 1][k][first + u][j];
    [[unroll]] for (int u = 0; u < kRadius; ++u) sum += line[u];
    ivec4 sums;
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        sums[m] = sum + singles[group & 1][k][first + m + kRadius][j];
        if (m < kRun - 1) sum += line[m + kRadius] - line[m];
    }
    return sums;
}

vec2 right_statistics_at(int x, int j) {
    return x >= 0 && x < push.half_width && j < push.half_samples_y
               ? right_statistics[j * push.half_width + x]
               : vec2(0.0);
}

void offer_right(int x, int j, int key) {
    if (key > 0 && x >= 0 && x < push.half_width && j < push.half_samples_y)
        atomicMax(right_keys[j * push.half_width + x], key);
}

ivec4 scored(vec4 sums, vec4 left_mean, vec4 left_root, vec4 right_sum, vec4 right_root,
             int index) {
    precise const vec4 expected = left_mean * right_sum;
    precise const vec4 covariance = sums - expected;
    precise const vec4 roots = left_root * right_root;
    precise const vec4 score = covariance * roots;
    return mix(ivec4(0), (floatBitsToInt(score) & ~255) | index, greaterThan(score, vec4(0.0)));
}

void main() {
    const int me = int(gl_LocalInvocationIndex),
              groups = (push.count + kGroup - 1) / kGroup;
    const bool scores = me < kScorers;
    const int place = kRun * (me / kSamples % (kSamples / kRun)), row = me % kSamples;
    const int first = int(gl_WorkGroupID.x) * kSamples + place,
              j = int(gl_WorkGroupID.y) * kSamples + row;

    vec4 left_mean, left_root;
    // Of the right pixels that even and odd indices meet: those of two disparities before.
    vec4 right_sum[2], right_root[2];
    ivec4 right_best[2] = ivec4[](ivec4(0), ivec4(0));
    ivec4 winner = ivec4(0), second = ivec4(0);
    ivec4 last_best = ivec4(0), before = ivec4(0);  // keys of the last group, and of all before it
    if (scores) [[unroll]]
        for (int m = 0; m < kRun; ++m) {
            const vec2 left = first + m < push.half_samples_x && j < push.half_samples_y
                                  ? left_statistics[j * push.half_samples_x + first + m]
                                  : vec2(0.0);
            left_mean[m] = left.x;
            left_root[m] = left.y;
            [[unroll]] for (int c = 0; c < 2; ++c) {
                const vec2 right =
                    right_statistics_at(2 * (first + m + 1) - push.first - c, j);
                right_sum[c][m] = right.x;
                right_root[c][m] = right.y;
            }
        }

    for (int step = 0; step <= groups; ++step) {
        const int group = step - 1;
        if (!scores) {
            if (step < groups) sum_columns(step, me - kScorers);
        } else if (step > 0) {
            ivec4 best = ivec4(0);
            for (int k = 0; k < kGroup; k += 2) [[unroll]]
                for (int c = 0; c < 2; ++c) {
                    const int index = group * kGroup + k + c, d = push.first + index;
                    if (index >= push.count) continue;
                    offer_right(2 * (first + kRun) - d, j, right_best[c].w);
                    const vec2 right = right_statistics_at(2 * first - d, j);
                    right_sum[c] = vec4(right.x, right_sum[c].xyz);
                    right_root[c] = vec4(right.y, right_root[c].xyz);
                    const ivec4 sums = sum_windows(group, k + c, place, row);
                    const ivec4 key = scored(vec4(sums), left_mean, left_root, right_sum[c],
                                             right_root[c], index);
                    best = max(best, key);
                    right_best[c] = max(ivec4(0, right_best[c].xyz), key);
                }
            const bvec4 wins = greaterThan(best, winner);
            const bvec4 apart = greaterThan(group - ((winner & 255) >> 2), ivec4(1));
            second = mix(mix(second, max(second, best), apart), before, wins);
            winner = max(winner, best);
            before = max(before, last_best);
            last_best = best;
        }
        barrier();
    }

    if (!scores || j >= push.half_samples_y) return;
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        [[unroll]] for (int c = 0; c < 2; ++c) {
            const int last = push.count - 1 - ((push.count - 1 + c) & 1);
            offer_right(2 * (first + m) - push.first - last, j, right_best[c][m]);
        }
        if (first + m >= push.half_samples_x) continue;
        left_keys[j * push.half_samples_x + first + m] = winner[m];
        seconds[j * push.half_samples_x + first + m] = second[m];
    }
}
