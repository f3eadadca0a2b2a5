// Stage orb, section 5: one invocation per cell looks at rings of cells round its own, until none of the next ring can be nearer. Also counts
// the corners of each distance, and of each distance and score.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
#include "orb_selection.glsl"
layout(local_size_x = 128) in;

layout(std430, set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Distances { uint8_t distances[]; };
layout(std430, set = 0, binding = 3) buffer CountsBuffer { Counts counts; };

const int kFarthest = 63;

shared uint of_distance[kDistances];

int nearest_stronger(Level level, int index, uint own) {
    const ivec2 cells = ivec2(level.cells_x, level.cells_y);
    const ivec2 cell = ivec2(index % cells.x, index / cells.x);
    const ivec2 own_place = ivec2(own & 255, own >> 8 & 255);
    int nearest = kFarthest;
    for (int ring = 1; (ring - 1) * push.cell + 1 < nearest; ++ring)
        for (int k = -ring; k < ring; ++k) {
            const ivec2 sides[4] = ivec2[](ivec2(k, -ring), ivec2(ring, k), ivec2(-k, ring), ivec2(-ring, -k));
            for (int side = 0; side < 4; ++side) {
                const ivec2 to = sides[side], at = cell + to;
                if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, cells))) continue;
                const uint other = corners[level.first_cell + at.y * cells.x + at.x];
                const bool earlier = to.y < 0 || (to.y == 0 && to.x < 0);
                if (other >> 16 < (own >> 16) + (earlier ? 0 : 1)) continue;
                const ivec2 away = abs(push.cell * to + ivec2(other & 255, other >> 8 & 255) - own_place);
                nearest = min(nearest, max(away.x, away.y));
            }
        }
    return nearest;
}

void main() {
    const uint me = gl_LocalInvocationIndex;
    if (me < kDistances) of_distance[me] = 0;
    barrier();
    const Level level = levels[gl_GlobalInvocationID.z];
    const int index = int(gl_GlobalInvocationID.x);
    if (index < level.cells_x * level.cells_y) {
        const uint own = corners[level.first_cell + index];
        int distance = 0;
        if (own != 0) {
            distance = nearest_stronger(level, index, own);
            atomicAdd(of_distance[distance], 1);
            atomicAdd(counts.of_score[distance][own >> 16], 1);
        }
        distances[level.first_cell + index] = uint8_t(distance);
    }
    barrier();
    if (me < kDistances && of_distance[me] != 0) atomicAdd(counts.of_distance[me], of_distance[me]);
}
