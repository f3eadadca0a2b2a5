// Stage match, section 1: for each landmark the three nearest live features, or for each live
// feature the nearest landmark. One invocation per row of the table of distances and split of its
// columns.
#version 450
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

void main() {
    const bool of_landmarks = kOfLandmarks != 0;
    const uint live = min(live_count, sizes.features);
    const uint row = gl_GlobalInvocationID.x, split = gl_WorkGroupID.y;
    const uint columns = of_landmarks ? live : sizes.landmarks;
    const uint splits = of_landmarks ? sizes.feature_splits : sizes.landmark_splits;
    if (row >= (of_landmarks ? sizes.landmarks : live)) return;
    const uint share = (columns + splits - 1) / splits;
    const uint first = min(split * share, columns), end = min(first + share, columns);
    Descriptor own;
    if (of_landmarks)
        own = landmark(row);
    else
        own = feature(row);
    uvec3 best = uvec3(kNoKey);
    for (uint column = first; column < end; ++column) {
        Descriptor other;
        if (of_landmarks)
            other = feature(column);
        else
            other = landmark(column);
        const uint key = hamming(own, other) << 16 | column;
        if (of_landmarks) {
            const uint behind_first = max(best.x, key), behind_second = max(best.y, behind_first);
            best.y = min(best.y, behind_first);
            best.z = min(best.z, behind_second);
        }
        best.x = min(best.x, key);
    }
    if (of_landmarks)
        for (uint place = 0; place < 3; ++place)
            keys[(3 * split + place) * sizes.landmarks + row] = best[place];
    else
        keys[split * sizes.features + row] = best.x;
}
