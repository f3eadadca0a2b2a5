// Stage stereo, smoothing of section 6: along rows, then along columns. A work group per tile of 32
// x 32 pixels.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "backends/stages/stereo.hpp"
#include "stereo_push.h"
layout(local_size_x = 32, local_size_y = 5) in;

layout(constant_id = 0) const int kRadius = 3;
layout(constant_id = 1) const int kRange = 24;
layout(std430, set = 0, binding = 0) readonly buffer From { int16_t from[]; };
layout(std430, set = 0, binding = 1) writeonly buffer To { int16_t to[]; };
layout(push_constant) uniform Push { SmoothSize push; };

const int kTile = 32, kSide = kTile + 2 * kRadius, kInvocations = 160;
const int kRun = 8, kReach = kRun + 2 * kRadius;  // pixels that an invocation smooths along a line,
                                                  // and these with their neighbours
const int kReciprocal[8] = int[](0, 32767, 16384, 10923, 8192, 6554, 5461, 4681);

shared int cells[kSide][kSide + 1];
shared int rows[kSide][kTile + 1];

void smooth_run(int line[kReach], out int result[kRun]) {
    [[unroll]] for (int i = 0; i < kRun; ++i) {
        const int centre = line[i + kRadius];
        int sum = 0, n = 0;
        [[unroll]] for (int u = 0; u <= 2 * kRadius; ++u) {
            const int difference = line[i + u] - centre;
            // A missing one differs from every disparity by more than the range.
            const bool near = abs(difference) <= kRange;
            sum += near ? difference : 0;
            n += near ? 1 : 0;
        }
        result[i] = centre == kNoDisparity ? kNoDisparity
                                           : centre + ((sum * kReciprocal[n] + (1 << 14)) >> 15);
    }
}

void main() {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const int me = int(gl_LocalInvocationIndex);
    for (int i = me; i < kSide * kSide; i += kInvocations) {
        const int x = tile.x - kRadius + i % kSide, y = tile.y - kRadius + i / kSide;
        const bool inside = x >= 0 && x < push.width && y >= 0 && y < push.height;
        cells[i / kSide][i % kSide] = inside ? int(from[y * push.width + x]) : kNoDisparity;
    }
    barrier();
    int line[kReach], smoothed[kRun];
    for (int i = me; i < kSide * (kTile / kRun); i += kInvocations) {
        const int row = i % kSide, column = i / kSide * kRun;
        [[unroll]] for (int u = 0; u < kReach; ++u) line[u] = cells[row][column + u];
        smooth_run(line, smoothed);
        [[unroll]] for (int u = 0; u < kRun; ++u) rows[row][column + u] = smoothed[u];
    }
    barrier();
    const int x = tile.x + int(gl_LocalInvocationID.x), first = kRun * int(gl_LocalInvocationID.y);
    if (first >= kTile || x >= push.width) return;
    [[unroll]] for (int v = 0; v < kReach; ++v) line[v] = rows[first + v][gl_LocalInvocationID.x];
    smooth_run(line, smoothed);
    [[unroll]] for (int v = 0; v < kRun; ++v) {
        const int y = tile.y + first + v;
        if (y < push.height) to[y * push.to_stride + x] = int16_t(smoothed[v]);
    }
}
