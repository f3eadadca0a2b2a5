// Stage orb, section 5: one invocation per cell looks at rings of cells round its own, until none
// of the next ring can be nearer. Also counts the corners of each distance, and of each distance
// and score.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
const int kColumns = 16, kRows = 8;
layout(local_size_x = kColumns, local_size_y = kRows) in;

layout(std430, set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Distances { uint8_t distances[]; };
layout(std430, set = 0, binding = 3) buffer CountsBuffer { OrbCounts counts; };

const int kMaxRings = 16;  // with the smallest cells

shared uint
    near_by[(kColumns + 2 * kMaxRings) *
            (kRows + 2 * kMaxRings)];  // corners of the group's cells and the rings round them
shared uint of_distance[kDistances];

// Rings that can hold a corner nearer than the farthest.
int rings() { return (kFarthest - 2) / push.cell + 1; }

void load_corners(OrbLevel level, int stride) {
    const ivec2 first = ivec2(gl_WorkGroupID.xy) * ivec2(kColumns, kRows) - rings();
    for (int i = int(gl_LocalInvocationIndex); i < stride * (kRows + 2 * rings());
         i += kColumns * kRows) {
        const ivec2 cell = first + ivec2(i % stride, i / stride);
        const bool inside =
            cell.x >= 0 && cell.y >= 0 && cell.x < level.cells_x && cell.y < level.cells_y;
        near_by[i] = inside ? corners[int(level.first_cell) + cell.y * level.cells_x + cell.x] : 0;
    }
}

// The lesser of the nearest so far and the distance of the corner in the cell that far away, if it
// is stronger.
int nearer(int nearest, int at, int stride, ivec2 to) {
    const uint own = near_by[at], other = near_by[at + to.y * stride + to.x];
    const bool earlier = to.y < 0 || (to.y == 0 && to.x < 0);
    const bool stronger = other >> 16 >= (own >> 16) + (earlier ? 0 : 1);
    const ivec2 away = abs(push.cell * to + ivec2(other & 255, other >> 8 & 255) -
                           ivec2(own & 255, own >> 8 & 255));
    return stronger ? min(nearest, max(away.x, away.y)) : nearest;
}

int nearest_stronger(int at, int stride) {
    int nearest = kFarthest;
    for (int ring = 1; (ring - 1) * push.cell + 1 < nearest; ++ring)
        for (int k = -ring; k < ring; ++k) {
            nearest = nearer(nearest, at, stride, ivec2(k, -ring));
            nearest = nearer(nearest, at, stride, ivec2(ring, k));
            nearest = nearer(nearest, at, stride, ivec2(-k, ring));
            nearest = nearer(nearest, at, stride, ivec2(-ring, -k));
        }
    return nearest;
}

void main() {
    const uint me = gl_LocalInvocationIndex;
    const OrbLevel level = levels[gl_GlobalInvocationID.z];
    const int stride = kColumns + 2 * rings();
    if (me < kDistances) of_distance[me] = 0;
    load_corners(level, stride);
    barrier();
    const ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    if (cell.x < level.cells_x && cell.y < level.cells_y) {
        const int at = (int(gl_LocalInvocationID.y) + rings()) * stride +
                       int(gl_LocalInvocationID.x) + rings();
        int distance = 0;
        if (near_by[at] != 0) {
            distance = nearest_stronger(at, stride);
            atomicAdd(of_distance[distance], 1);
            atomicAdd(counts.of_score[distance][near_by[at] >> 16], 1);
        }
        distances[int(level.first_cell) + cell.y * level.cells_x + cell.x] = uint8_t(distance);
    }
    barrier();
    if (me < kDistances && of_distance[me] != 0) atomicAdd(counts.of_distance[me], of_distance[me]);
}
