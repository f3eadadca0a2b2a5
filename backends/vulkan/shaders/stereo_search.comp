// Stage stereo, section 3: the search. A work group has a tile of 32 x 32 left pixels and goes
// through the disparities in groups of four. First its invocations sum the products of a disparity
// along the columns of the windows; then each adds up the columns for 8 pixels of a row and scores
// them. The right pixels that these 8 meet move on by one from disparity to disparity, and so do
// their best keys.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(local_size_x = 32, local_size_y = 5) in;  // the last row only helps with the columns

layout(constant_id = 0) const int kRadius = 4;
layout(std430, set = 0, binding = 0) readonly buffer LeftWords {
    int left_words[];
};  // stereo_pack.comp
layout(std430, set = 0, binding = 1) readonly buffer RightWords { int right_words[]; };
layout(std430, set = 0, binding = 2) readonly buffer LeftStatistics { vec2 left_statistics[]; };
layout(std430, set = 0, binding = 3) readonly buffer RightStatistics { vec2 right_statistics[]; };
layout(std430, set = 0, binding = 4) writeonly buffer LeftKeys { int left_keys[]; };
layout(std430, set = 0, binding = 5) writeonly buffer Seconds { int seconds[]; };
layout(std430, set = 0, binding = 6) buffer RightKeys { int right_keys[]; };

const int kTile = 32, kInvocations = 160;
const int kColumns = kTile + 2 * kRadius;
const int kRun = 8, kQuads = kRun / 4;  // pixels of an invocation, in vectors of four
const int kKept = (kRadius + 1) / 2;    // words of the 2 kRadius rows before a window's last
const bool kOdd = (kRadius & 1) != 0;   // then of the last only half

shared ivec4 columns[kGroup][kColumns][kTile / 4 + 1];  // four rows in a vector

ivec4 pixels(int word) { return (ivec4(word) << ivec4(24, 16, 8, 0)) >> 24; }

// The products of four rows in a column, for disparity d.
ivec4 products(int q, int x, int d) {
    if (x < d || x >= push.half_width) return ivec4(0);
    const int row = q * push.half_width + x;
    return pixels(left_words[row]) * pixels(right_words[row - d]);
}

void sum_columns(int group) {
    const int x0 = int(gl_WorkGroupID.x) * kTile - kRadius,
              q0 = int(gl_WorkGroupID.y) * (kTile / 4);
    for (int i = int(gl_LocalInvocationIndex); i < kGroup * kColumns; i += kInvocations) {
        const int k = i / kColumns, column = i % kColumns, x = x0 + column,
                  d = push.first + group * kGroup + k;
        ivec4 inside[kKept];  // products of the rows that are in the window, the oldest first
        int sum = 0;
        [[unroll]] for (int q = 0; q < kKept; ++q) {
            inside[q] = products(q0 + q, x, d);
            sum += inside[q].x + inside[q].y;
            if (!kOdd || q < kKept - 1) sum += inside[q].z + inside[q].w;
        }
        [[unroll]] for (int q = 0; q < kTile / 4; ++q) {
            const ivec4 next = products(q0 + kKept + q, x, d), leaving = inside[0];
            const ivec4 entering = kOdd ? ivec4(inside[kKept - 1].zw, next.xy) : next;
            ivec4 sums;
            sums.x = sum + entering.x;
            sums.y = sums.x - leaving.x + entering.y;
            sums.z = sums.y - leaving.y + entering.z;
            sums.w = sums.z - leaving.z + entering.w;
            columns[k][column][q] = sums;
            sum = sums.w - leaving.w;
            [[unroll]] for (int t = 0; t < kKept - 1; ++t) inside[t] = inside[t + 1];
            inside[kKept - 1] = next;
        }
    }
}

// The windows of the invocation's pixels.
void sum_windows(int k, out ivec4 sums[kQuads]) {
    const int y = int(gl_LocalInvocationID.x), x = kRun * int(gl_LocalInvocationID.y);
    int line[kRun + 2 * kRadius];
    [[unroll]] for (int u = 0; u < kRun + 2 * kRadius; ++u) line[u] =
        columns[k][x + u][y / 4][y % 4];
    int sum = 0;
    [[unroll]] for (int u = 0; u < 2 * kRadius; ++u) sum += line[u];
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        sum += line[m + 2 * kRadius];
        sums[m / 4][m % 4] = sum;
        sum -= line[m];
    }
}

vec2 right_statistics_at(int x, int y) {
    return x >= 0 && x < push.half_width && y < push.half_height
               ? right_statistics[y * push.half_width + x]
               : vec2(0.0);
}

void offer_right(int x, int y, int key) {
    if (key > 0 && x >= 0 && x < push.half_width && y < push.half_height)
        atomicMax(right_keys[y * push.half_width + x], key);
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
    const bool scores = gl_LocalInvocationID.y < kTile / kRun;
    const ivec2 first = ivec2(gl_WorkGroupID.xy) * kTile +
                        ivec2(kRun * gl_LocalInvocationID.y, gl_LocalInvocationID.x);
    const int y = first.y, groups = (push.count + kGroup - 1) / kGroup;

    vec4 left_mean[kQuads], left_root[kQuads];
    vec4 right_sum[kQuads],
        right_root[kQuads];  // of the right pixels that the disparity before the next meets
    ivec4 right_best[kQuads];
    ivec4 winner[kQuads], second[kQuads];
    ivec4 best[kQuads], last_best[kQuads],
        before[kQuads];  // keys of this group, the last one, and all before that
    [[unroll]] for (int v = 0; v < kQuads; ++v) {
        [[unroll]] for (int m = 0; m < 4; ++m) {
            const int x = first.x + 4 * v + m;
            const vec2 left = x < push.half_width && y < push.half_height
                                  ? left_statistics[y * push.half_width + x]
                                  : vec2(0.0);
            const vec2 right = right_statistics_at(x - push.first + 1, y);
            left_mean[v][m] = left.x;
            left_root[v][m] = left.y;
            right_sum[v][m] = right.x;
            right_root[v][m] = right.y;
        }
        right_best[v] = winner[v] = second[v] = last_best[v] = before[v] = ivec4(0);
    }

    for (int group = 0; group < groups; ++group) {
        sum_columns(group);
        barrier();
        if (scores) {
            [[unroll]] for (int v = 0; v < kQuads; ++v) best[v] = ivec4(0);
            for (int k = 0; k < kGroup; ++k) {
                const int index = group * kGroup + k, d = push.first + index;
                if (index >= push.count) break;
                offer_right(first.x + kRun - d, y, right_best[kQuads - 1].w);
                vec2 right = right_statistics_at(first.x - d, y);
                int right_key = 0;
                ivec4 sums[kQuads];
                sum_windows(k, sums);
                [[unroll]] for (int v = 0; v < kQuads; ++v) {
                    const vec2 leaving = vec2(right_sum[v].w, right_root[v].w);
                    const int leaving_key = right_best[v].w;
                    right_sum[v] = vec4(right.x, right_sum[v].xyz);
                    right_root[v] = vec4(right.y, right_root[v].xyz);
                    right_best[v] = ivec4(right_key, right_best[v].xyz);
                    right = leaving;
                    right_key = leaving_key;
                    const ivec4 key = scored(vec4(sums[v]), left_mean[v], left_root[v],
                                             right_sum[v], right_root[v], index);
                    best[v] = max(best[v], key);
                    right_best[v] = max(right_best[v], key);
                }
            }
            [[unroll]] for (int v = 0; v < kQuads; ++v) {
                const bvec4 wins = greaterThan(best[v], winner[v]);
                const bvec4 apart = greaterThan(group - ((winner[v] & 255) >> 2), ivec4(1));
                second[v] = mix(mix(second[v], max(second[v], best[v]), apart), before[v], wins);
                winner[v] = max(winner[v], best[v]);
                before[v] = max(before[v], last_best[v]);
                last_best[v] = best[v];
            }
        }
        barrier();
    }

    if (!scores || y >= push.half_height) return;
    const int last = push.first + push.count - 1;
    [[unroll]] for (int v = 0; v < kQuads; ++v) [[unroll]] for (int m = 0; m < 4; ++m) {
        const int x = first.x + 4 * v + m;
        offer_right(x - last, y, right_best[v][m]);
        if (x >= push.half_width) continue;
        left_keys[y * push.half_width + x] = winner[v][m];
        seconds[y * push.half_width + x] = second[v][m];
    }
}
