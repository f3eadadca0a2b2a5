// Stage match, section 1: for each landmark the three nearest live features, or for each live
// feature the nearest landmark. One invocation per row of the table of distances and split of its
// columns.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#include "match.glsl"
layout(constant_id = 0) const uint kOfLandmarks = 1;
layout(local_size_x = 64) in;

// Records of 48 bytes; 32 of them are the descriptor.
layout(std430, set = 0, binding = 0) readonly buffer Landmarks { uvec4 landmarks[]; };
layout(std430, set = 0, binding = 1) readonly buffer Features { uvec4 features[]; };
layout(std430, set = 0, binding = 2) readonly buffer Count { uint live_count; };
layout(std430, set = 0, binding = 3) writeonly buffer Keys { uint keys[]; };

layout(push_constant) uniform Push { MatchSizes sizes; };

struct Descriptor {
    uvec4 low, high;
};
Descriptor landmark(uint i) { return Descriptor(landmarks[3 * i], landmarks[3 * i + 1]); }
Descriptor feature(uint i) { return Descriptor(features[3 * i + 1], features[3 * i + 2]); }

// The bits of three words added up: ones, and carries that count twice.
uint ones(uint a, uint b, uint c) { return a ^ b ^ c; }
uint twos(uint a, uint b, uint c) { return (a & b) | (c & (a ^ b)); }

uint hamming(Descriptor a, Descriptor b) {
    const uvec4 low = a.low ^ b.low, high = a.high ^ b.high;
    const uint ones1 = ones(low.x, low.y, low.z), twos1 = twos(low.x, low.y, low.z);
    const uint ones2 = ones(low.w, high.x, high.y), twos2 = twos(low.w, high.x, high.y);
    const uint ones3 = ones(ones1, ones2, high.z), twos3 = twos(ones1, ones2, high.z);
    const uint fours = twos(twos1, twos2, twos3), last_twos = ones(twos1, twos2, twos3);
    return uint(bitCount(ones3) + bitCount(high.w) + 2 * bitCount(last_twos) + 4 * bitCount(fours));
}

const bool kLandmarks = kOfLandmarks != 0;
const uint kAhead = 4;  // columns that are loaded at a time: on a GPU their latency takes time

Descriptor column_at(uint column) {
    if (kLandmarks) return feature(column);
    return landmark(column);
}

// The smallest keys so far with one more.
uvec3 with(uvec3 best, uint key) {
    if (!kLandmarks) return uvec3(min(best.x, key), best.yz);
    const uint behind_first = max(best.x, key), behind_second = max(best.y, behind_first);
    return min(best, uvec3(key, behind_first, behind_second));
}

void main() {
    const uint live = min(live_count, sizes.features);
    const uint row = gl_GlobalInvocationID.x, split = gl_WorkGroupID.y;
    const uint columns = kLandmarks ? live : sizes.landmarks;
    const uint splits = kLandmarks ? sizes.feature_splits : sizes.landmark_splits;
    if (row >= (kLandmarks ? sizes.landmarks : live)) return;
    const uint share = (columns + splits - 1) / splits;
    const uint first = min(split * share, columns), end = min(first + share, columns);
    Descriptor own;
    if (kLandmarks)
        own = landmark(row);
    else
        own = feature(row);
    uvec3 best = uvec3(kNoKey);
    uint column = first;
    for (; column + kAhead <= end; column += kAhead) {
        Descriptor others[kAhead];
        [[unroll]] for (uint k = 0; k < kAhead; ++k) others[k] = column_at(column + k);
        [[unroll]] for (uint k = 0; k < kAhead; ++k) best =
            with(best, hamming(own, others[k]) << 16 | (column + k));
    }
    for (; column < end; ++column)
        best = with(best, hamming(own, column_at(column)) << 16 | column);
    if (kLandmarks) [[unroll]]
        for (uint place = 0; place < 3; ++place)
            keys[(3 * split + place) * sizes.landmarks + row] = best[place];
    else
        keys[split * sizes.features + row] = best.x;
}
