// Stage orb, section 4: one invocation per cell.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
layout(local_size_x = 128) in;
layout(constant_id = 0) const int kWords = 5;  // at most that a row of a cell is in

layout(std430, set = 0, binding = 1) readonly buffer Scores { uint scores[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Corners { uint corners[]; };

void main() {
    const OrbLevel level = levels[gl_GlobalInvocationID.z];
    const int index = int(gl_GlobalInvocationID.x);
    if (index >= level.cells_x * level.cells_y) return;
    const ivec2 first = kBorder + push.cell * ivec2(index % level.cells_x, index / level.cells_x);
    const ivec2 end = min(first + push.cell, ivec2(level.width, level.height) - kBorder);
    int best = 0;  // score << 8 | (15 - y) << 4 | (15 - x): the largest is the strongest, then the
                   // first in raster order
    for (int y = first.y; y < end.y; ++y) {
        const int at = word_at(level, first.x >> 2, y);
        uint words[kWords];
        [[unroll]] for (int w = 0; w < kWords; ++w) words[w] =
            4 * ((first.x >> 2) + w) < end.x ? scores[at + w] : 0;
        [[unroll]] for (int w = 0; w < kWords; ++w) {
            if (words[w] == 0) continue;
            const ivec4 x = 4 * ((first.x >> 2) + w) + ivec4(0, 1, 2, 3) - first.x;
            const ivec4 inside =
                ivec4(greaterThanEqual(x, ivec4(0))) * ivec4(lessThan(x, end.xxxx - first.x));
            const ivec4 key = inside * (bytes_from(uvec3(words[w], 0, 0), 0) << 8 |
                                        (15 - (y - first.y)) << 4 | 15 - x);
            best = max(best, max(max(key.x, key.y), max(key.z, key.w)));
        }
    }
    corners[int(level.first_cell) + index] =
        best < 256
            ? 0
            : uint(best >> 8) << 16 | uint(15 - (best >> 4 & 15)) << 8 | uint(15 - (best & 15));
}
