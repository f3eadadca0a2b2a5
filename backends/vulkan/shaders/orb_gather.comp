// Stage orb, section 6: the cells of the kept corners, in order, and their number.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
layout(local_size_x = 256) in;

layout(std430, set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(std430, set = 0, binding = 2) readonly buffer Distances { uint distances[]; };
layout(std430, set = 0, binding = 3) readonly buffer Blocks { uint in_block[]; };
layout(std430, set = 0, binding = 4) buffer SelectionBuffer { OrbSelection selection; };
layout(std430, set = 0, binding = 5) writeonly buffer Kept { uint kept_cells[]; };
layout(std430, set = 0, binding = 6) writeonly buffer Count { uint count; };
#include "orb_kept.glsl"

const uint kSize = 256;
shared uint sums[kSize];
shared uint before_block;

void main() {
    const uint me = gl_LocalInvocationIndex;
    const bvec4 kept =
        kept_of(int(gl_GlobalInvocationID.x), int(selection.distance), selection.score);
    const uint own = uint(kept.x) + uint(kept.y) + uint(kept.z) + uint(kept.w);
    if (me == 0) before_block = 0;
    sums[me] = own;
    barrier();
    uint before = 0;
    for (uint block = me; block < gl_WorkGroupID.x; block += kSize) before += in_block[block];
    if (before != 0) atomicAdd(before_block, before);
    for (uint step = 1; step < kSize; step <<= 1) {
        const uint added = me >= step ? sums[me - step] : 0;
        barrier();
        sums[me] += added;
        barrier();
    }
    uint next = before_block + sums[me] - own;
    for (int i = 0; i < 4; ++i)
        if (kept[i]) kept_cells[next++] = 4 * gl_GlobalInvocationID.x + i;
    if (me == kSize - 1 && gl_WorkGroupID.x == gl_NumWorkGroups.x - 1) {
        count = next;
        selection.groups = uint[](next, 1, 1);
    }
}
