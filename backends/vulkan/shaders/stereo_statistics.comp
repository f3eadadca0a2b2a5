// Stage stereo, section 3: what a score needs to know of each window of a half image, around the
// samples of the left one and all pixels of the right one's even rows. The left image also gets the
// first checks of section 4. A work group per tile of 32 x 32 pixels.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(local_size_x = 96) in;

layout(constant_id = 0) const int kRadius = 4;
layout(constant_id = 1) const bool kRight = false;
layout(std430, set = 0, binding = 0) readonly buffer Columns { int column_words[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Statistics {
    vec2 statistics[];
};  // mean, or right sum; root of the variance
layout(std430, set = 0, binding = 2) buffer LeftUsable { uint8_t left_usable[]; };

const int kTile = 32, kRows = kTile / 2, kInvocations = 96;
const int kColumns = kTile + 2 * kRadius;
const int kPart = kTile / 2;  // rows of the tile that an invocation goes down
const int kRun = 8, kReach = kRun + 2 * kRadius;

// Sums along a column of the windows of each even row: of squares, and of values in the lower 12
// bits.
shared int columns[kRows][kColumns + 1];

void sum_columns(ivec2 tile, int me) {
    for (int i = me; i < kColumns * (kTile / kPart); i += kInvocations) {
        const int column = i % kColumns, part = i / kColumns, x = tile.x - kRadius + column,
                  y = tile.y + part * kPart;
        int values[kPart + 2 * kRadius], word = 0, sum = 0;
        [[unroll]] for (int v = 0; v < kPart + 2 * kRadius - 1; ++v) {
            const int row = v - kRadius;  // from y, which is a multiple of 4
            if (v == 0 || (row & 3) == 0) {
                const int q = (y >> 2) + (row >> 2);
                const bool inside =
                    x >= 0 && x < push.half_width && q >= 0 && q < words_of(push.half_height);
                word = inside ? column_words[q * push.half_width + x] : 0;
            }
            const int value = pixel(word, row & 3);
            values[v] = value * value * 4096 + value;
            sum += values[v];
            if (v >= 2 * kRadius && (v & 1) == 0)
                columns[part * (kPart / 2) + (v - 2 * kRadius) / 2][column] = sum;
            if (v >= 2 * kRadius) sum -= values[v - 2 * kRadius];
        }
    }
}

void main() {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const int me = int(gl_LocalInvocationIndex);
    sum_columns(tile, me);
    barrier();
    const int n = (2 * kRadius + 1) * (2 * kRadius + 1), row = me % kRows,
              first = me / kRows * kRun, y = tile.y + 2 * row;
    if (first >= kTile || y >= push.half_height) return;
    int line[kReach], sum = 0, squares = 0;
    [[unroll]] for (int u = 0; u < kReach; ++u) line[u] = columns[row][first + u];
    [[unroll]] for (int u = 0; u < kReach; ++u) {
        const int value = (line[u] << 20) >> 20;
        sum += value;
        squares += (line[u] - value) >> 12;
        const int m = u - 2 * kRadius, x = tile.x + first + m;
        if (m < 0) continue;
        if ((kRight || (m & 1) == 0) && x < push.half_width) {
            const bool whole = x >= kRadius && x < push.half_width - kRadius && y >= kRadius &&
                               y < push.half_height - kRadius;
            const int variance = whole ? n * squares - sum * sum : 0;
            const float root = inverse_root(variance);
            if (kRight) {
                const int i = y / 2 * push.half_width + x;
                statistics[i] = vec2(whole ? float(sum) : 0.0, root);
            } else {
                precise const float mean = float(sum) * push.one_over_n;
                statistics[y / 2 * push.half_samples_x + x / 2] = vec2(whole ? mean : 0.0, root);
                if (!has_texture(variance, n))
                    left_usable[y / 2 * push.half_width + x] = uint8_t(0);
            }
        }
        const int leaving = (line[m] << 20) >> 20;
        sum -= leaving;
        squares -= (line[m] - leaving) >> 12;
    }
}
