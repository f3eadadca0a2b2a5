// Stage lm: D_i, the weight of the data at each control point, at the start, and the sums of
// lm_weights.glsl. kSplit invocations share a control point.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
#include "lm_blocks.glsl"

layout(std430, set = 0, binding = 0) readonly buffer Blocks { LmBlock blocks[]; };
layout(std430, set = 0, binding = 1) readonly buffer ItemTerms { uint item_terms[]; };
layout(std430, set = 0, binding = 2) readonly buffer Items { vec4 items[]; };
layout(std430, set = 0, binding = 3) readonly buffer Records { vec4 records[]; };
layout(std430, set = 0, binding = 4) readonly buffer EdgeTerms { LmEdgeTerm edge_terms[]; };
layout(std430, set = 0, binding = 5) readonly buffer EdgeCosts { float edge_costs[]; };
layout(std430, set = 0, binding = 6) buffer Data { float data[]; };
#include "lm_weights.glsl"

shared vec2 shares[kBlockGroup];  // D_i, and the costs of its edges
shared vec4 sums[kBlockGroup];

void main() {
    const uint me = gl_LocalInvocationIndex, split = me % kSplit,
               i = gl_GlobalInvocationID.x / kSplit;
    LmBlock block = LmBlock(0, 0, 0, 0, 0, 0, 0, 0);
    if (i < push.nodes) block = blocks[i];
    vec2 own = vec2(0);
    for (uint at = block.first_item + split; at < block.last_item; at += kSplit) {
        const uint term = item_terms[at], item = term_item(term), k = term_row(term);
        if (k == term_column(term))
            own.x += items[kItemVectors * item + 2 + k].w * records[kRecordVectors * item].w;
    }
    for (uint at = block.first_edge + split; at < block.last_edge; at += kSplit)
        own.y += edge_costs[term_edge(edge_terms[at])];
    shares[me] = own;
    for (uint apart = kSplit / 2; apart > 0; apart /= 2) {
        barrier();
        if (split < apart) shares[me] += shares[me + apart];
    }
    own = shares[me];
    if (split == 0) {
        if (i < push.nodes) data[i] = own.x;
        sums[me] = vec4(own.x * vec3(1, own.x, 0.25 * own.y), 0.25 * own.y);
    }
    barrier();
    if (me != 0) return;
    vec4 sum = vec4(0);
    for (uint k = 0; k < kBlockGroup; k += kSplit) sum += sums[k];
    const uint to = data_sums_at(gl_WorkGroupID.x);
    for (int k = 0; k < 4; ++k) data[to + k] = sum[k];
}
