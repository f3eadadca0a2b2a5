// Stage stereo, section 7. A work group per tile of 32 x 32 pixels.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, set = 0, binding = 0) readonly buffer Dense { int16_t dense[]; };
layout(std430, set = 0, binding = 1) readonly buffer Supported { int16_t supported[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Standing { uint8_t standing[]; };

const int kRadius = kEdgeRadius, kTile = 32, kSide = kTile + 2 * kRadius, kInvocations = 256;

shared int cells[kSide][kSide];
shared int rows_min[kSide][kTile], rows_max[kSide][kTile];

void main() {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const int me = int(gl_LocalInvocationIndex);
    for (int i = me; i < kSide * kSide; i += kInvocations) {
        const ivec2 at = clamp(tile - kRadius + ivec2(i % kSide, i / kSide), ivec2(0),
                               ivec2(push.half_width, push.half_height) - 1);
        cells[i / kSide][i % kSide] = int(dense[at.y * push.half_width + at.x]);
    }
    barrier();
    for (int i = me; i < kSide * kTile; i += kInvocations) {
        const int row = i / kTile, column = i % kTile;
        int minimum = cells[row][column], maximum = minimum;
        for (int u = 1; u <= 2 * kRadius; ++u) {
            minimum = min(minimum, cells[row][column + u]);
            maximum = max(maximum, cells[row][column + u]);
        }
        rows_min[row][column] = minimum;
        rows_max[row][column] = maximum;
    }
    barrier();
    for (int i = me; i < kTile * kTile; i += kInvocations) {
        const int row = i / kTile, column = i % kTile, x = tile.x + column, y = tile.y + row;
        if (x >= push.half_width || y >= push.half_height) continue;
        int minimum = rows_min[row][column], maximum = rows_max[row][column];
        for (int v = 1; v <= 2 * kRadius; ++v) {
            minimum = min(minimum, rows_min[row + v][column]);
            maximum = max(maximum, rows_max[row + v][column]);
        }
        const int at = y * push.half_width + x;
        const bool doubtful = cells[row + kRadius][column + kRadius] - minimum > push.edge;
        const bool open = maximum - minimum > push.edge || int(supported[at]) == kNoDisparity;
        standing[at] = uint8_t(doubtful ? kDoubtful : open ? kOpen : kSettled);
    }
}
