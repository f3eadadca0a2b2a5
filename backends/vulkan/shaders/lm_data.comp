// Stage lm: D_i, the weight of the data at each control point, at the start. kSplit invocations
// share a control point.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
#include "lm_blocks.glsl"

layout(std430, set = 0, binding = 0) readonly buffer Blocks { LmBlock blocks[]; };
layout(std430, set = 0, binding = 1) readonly buffer ItemTerms { uint item_terms[]; };
layout(std430, set = 0, binding = 2) readonly buffer Items { vec4 items[]; };
layout(std430, set = 0, binding = 3) readonly buffer Records { vec4 records[]; };
layout(std430, set = 0, binding = 4) writeonly buffer Data { float data[]; };
layout(std430, set = 0, binding = 5) writeonly buffer DataSums {
    vec2 data_sums[];
};  // of each work group: D_i and its square

shared float shares[kBlockGroup];
shared vec2 sums[kBlockGroup];

void main() {
    const uint me = gl_LocalInvocationIndex, split = me % kSplit,
               i = gl_GlobalInvocationID.x / kSplit;
    uint next = 0, end = 0;
    if (i < push.nodes) {
        next = blocks[i].first_item + split;
        end = blocks[i].last_item;
    }
    float own = 0.0;
    for (uint at = next; at < end; at += kSplit) {
        const uint term = item_terms[at], item = term_item(term), k = term_row(term);
        if (k == term_column(term))
            own += items[kItemVectors * item + 2 + k].w * records[kRecordVectors * item].w;
    }
    shares[me] = own;
    for (uint apart = kSplit / 2; apart > 0; apart /= 2) {
        barrier();
        if (split < apart) shares[me] += shares[me + apart];
    }
    own = shares[me];
    vec2 square = vec2(0);
    if (split == 0 && i < push.nodes) {
        data[i] = own;
        square = vec2(own, own * own);
    }
    sums[me] = square;
    barrier();
    if (me != 0) return;
    vec2 sum = vec2(0);
    for (uint k = 0; k < kBlockGroup; k += kSplit) sum += sums[k];
    data_sums[gl_WorkGroupID.x] = sum;
}
