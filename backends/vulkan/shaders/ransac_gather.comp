// Stage ransac: the matches that take part, in their order, and H. One work group.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#include "ransac.glsl"
layout(local_size_x = 1024) in;  // kSize

layout(std430, set = 0, binding = 0) readonly buffer Landmarks { Landmark landmarks[]; };
layout(std430, set = 0, binding = 1) readonly buffer Matches { Match matches[]; };
layout(std430, set = 0, binding = 2) writeonly buffer From { vec4 from[]; };
layout(std430, set = 0, binding = 3) buffer To { vec4 to[]; };
layout(std430, set = 0, binding = 4) writeonly buffer PairOf {
    uint pair_of[];
};  // by landmark; kNone: takes no part
layout(std430, set = 0, binding = 5) writeonly buffer FrameBuffer { RansacFrame frame; };

// Counts of invocations in groups of kGroup, which are added by one invocation each, so that there
// are few barriers.
const uint kSize = 1024, kGroup = 32, kGroups = kSize / kGroup;
shared uint counts[kGroups][kGroup + 1], group_counts[kGroups];
shared uint pairs;
shared vec4 sums[kSize], parts[kSize / 16], last_parts[8];

bool usable(float position[3]) {
    return all(lessThan(abs(vec3(position[0], position[1], position[2])), vec3(kMaxCoordinateMm)));
}
// Everything is loaded before anything is decided.
bool takes_part(uint i) {
    const int feature = matches[i].feature;
    const float weight = matches[i].weight;
    const float from_position[3] = landmarks[i].position, to_position[3] = matches[i].position;
    const bvec4 all_of =
        bvec4(feature >= 0, weight > 0.0, usable(from_position), usable(to_position));
    return all(all_of);
}
vec3 vector(float v[3]) { return vec3(v[0], v[1], v[2]); }

// The sum over the work group, to all of it.
vec4 sum_over_group(vec4 own, uint me) {
    sums[me] = own;
    barrier();
    if (me < kSize / 16) {
        vec4 sum = sums[me];
        [[unroll]] for (uint i = 1; i < 16; ++i) sum += sums[me + i * (kSize / 16)];
        parts[me] = sum;
    }
    barrier();
    if (me < 8) {
        vec4 sum = parts[me];
        [[unroll]] for (uint i = 1; i < kSize / 16 / 8; ++i) sum += parts[me + i * 8];
        last_parts[me] = sum;
    }
    barrier();
    vec4 total = last_parts[0];
    [[unroll]] for (uint i = 1; i < 8; ++i) total += last_parts[i];
    return total;
}

// The sum of the invocations' numbers before this one; leaves that of all in pairs.
uint count_before(uint own, uint me) {
    counts[me / kGroup][me % kGroup] = own;
    barrier();
    uint line[kGroup], sum = 0;
    if (me < kGroups) {
        [[unroll]] for (uint i = 0; i < kGroup; ++i) {
            line[i] = counts[me][i];
            sum += line[i];
        }
        group_counts[me] = sum;
    }
    barrier();
    if (me < kGroups) {
        uint before = 0;
        [[unroll]] for (uint i = 0; i < kGroups; ++i) before += i < me ? group_counts[i] : 0;
        if (me == kGroups - 1) pairs = before + sum;
        [[unroll]] for (uint i = 0; i < kGroup; ++i) {
            counts[me][i] = before;
            before += line[i];
        }
    }
    barrier();
    return counts[me / kGroup][me % kGroup];
}

void main() {
    const uint me = gl_LocalInvocationIndex;
    const uint share = (push.landmarks + kSize - 1) / kSize;
    const uint first = min(me * share, push.landmarks), last = min(first + share, push.landmarks);
    uint own = 0;
    for (uint i = first; i < last; ++i) own += takes_part(i) ? 1 : 0;
    const uint begin = count_before(own, me);
    uint next = begin;
    vec4 sum = vec4(0);
    for (uint i = first; i < last; ++i) {
        const bool taken = takes_part(i);
        pair_of[i] = taken ? next : kNone;
        if (!taken) continue;
        from[next] = vec4(vector(landmarks[i].position), 0);
        to[next] = vec4(vector(matches[i].position), 0);
        sum += to[next];
        ++next;
    }
    const vec4 centre = sum_over_group(sum, me) / float(max(pairs, 1));
    float squares = 0.0;
    for (uint i = begin; i < next; ++i) {
        const vec4 d = to[i] - centre;
        squares += d.x * d.x + d.y * d.y + d.z * d.z;
    }
    const float mean = sum_over_group(vec4(squares, 0, 0, 0), me).x / float(max(pairs, 1));
    if (me != 0) return;
    const float threshold = push.threshold_mm > 0.0
                                ? push.threshold_mm
                                : max(kMinThreshold, kThresholdShare * sqrt(mean));
    frame = RansacFrame(pairs, min(push.references, pairs), threshold, 0);
}
