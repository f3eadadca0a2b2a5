// Stage orb, section 6: which corners are kept, which every work group finds for itself; and how
// many there are in each block of cells.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
layout(local_size_x = 256) in;

layout(std430, set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(std430, set = 0, binding = 2) readonly buffer Distances { uint distances[]; };
layout(std430, set = 0, binding = 3) readonly buffer CountsBuffer { OrbCounts counts; };
layout(std430, set = 0, binding = 4) writeonly buffer SelectionBuffer { OrbSelection selection; };
layout(std430, set = 0, binding = 5) writeonly buffer Blocks { uint in_block[]; };
#include "orb_kept.glsl"

shared uint sums[kScores];
shared uint min_distance, min_score, in_this_block;

// Adds to each of the sums all behind it.
void sum_from_behind(uint me) {
    barrier();
    for (uint step = 1; step < kScores; step <<= 1) {
        const uint behind = me + step < kScores ? sums[me + step] : 0;
        barrier();
        sums[me] += behind;
        barrier();
    }
}

void main() {
    const uint me = gl_LocalInvocationIndex, spacing = uint(push.spacing),
               capacity = uint(push.capacity);
    if (me == 0) in_this_block = 0;
    sums[me] = me < kDistances ? counts.of_distance[me] : 0;
    sum_from_behind(me);
    // Here and below one invocation finds the border.
    if (me >= spacing && me <= kDistances && sums[me] <= capacity &&
        (me == spacing || sums[me - 1] > capacity))
        min_distance = me;
    barrier();
    const uint distance = min_distance, kept_farther = sums[distance];
    barrier();

    sums[me] = counts.of_score[distance - 1][me];
    sum_from_behind(me);
    const uint room = capacity - kept_farther, at_least = me + 1;
    if (distance == spacing) {
        if (me == 0) min_score = kScores;
    } else if ((at_least == kScores || sums[at_least] <= room) && (me == 0 || sums[me] > room)) {
        min_score = at_least;
    }
    barrier();

    const bvec4 kept = kept_of(int(gl_GlobalInvocationID.x), int(distance), min_score);
    const uint count = uint(kept.x) + uint(kept.y) + uint(kept.z) + uint(kept.w);
    if (count != 0) atomicAdd(in_this_block, count);
    barrier();
    if (me != 0) return;
    in_block[gl_WorkGroupID.x] = in_this_block;
    if (gl_WorkGroupID.x == 0) {
        selection.distance = distance;
        selection.score = min_score;
    }
}
