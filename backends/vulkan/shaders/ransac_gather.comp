// Stage ransac: the matches that take part, in their order, and H. One work group.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "ransac.glsl"
layout(local_size_x = 1024) in;

layout(std430, set = 0, binding = 0) readonly buffer Landmarks { Landmark landmarks[]; };
layout(std430, set = 0, binding = 1) readonly buffer Matches { Match matches[]; };
layout(std430, set = 0, binding = 2) writeonly buffer From { vec4 from[]; };
layout(std430, set = 0, binding = 3) buffer To { vec4 to[]; };
layout(std430, set = 0, binding = 4) writeonly buffer PairOf {
    uint pair_of[];
};  // by landmark; kNone: takes no part
layout(std430, set = 0, binding = 5) writeonly buffer FrameBuffer { RansacFrame frame; };

shared uint counts[1024];
shared vec4 sums[1024];

bool usable(float position[3]) {
    return abs(position[0]) < 1e6 && abs(position[1]) < 1e6 && abs(position[2]) < 1e6;
}
bool takes_part(uint i) {
    return matches[i].feature >= 0 && matches[i].weight > 0.0 && usable(landmarks[i].position) &&
           usable(matches[i].position);
}
vec3 vector(float v[3]) { return vec3(v[0], v[1], v[2]); }

// The sum over the work group, to all of it.
vec4 sum_over_group(vec4 own, uint me) {
    sums[me] = own;
    barrier();
    for (uint half_size = 512; half_size > 0; half_size >>= 1) {
        if (me < half_size) sums[me] += sums[me + half_size];
        barrier();
    }
    const vec4 total = sums[0];
    barrier();
    return total;
}

void main() {
    const uint me = gl_LocalInvocationIndex;
    const uint share = (push.landmarks + 1023) / 1024;
    const uint first = min(me * share, push.landmarks), last = min(first + share, push.landmarks);
    uint own = 0;
    for (uint i = first; i < last; ++i) own += takes_part(i) ? 1 : 0;
    counts[me] = own;
    barrier();
    for (uint distance = 1; distance < 1024; distance <<= 1) {
        const uint before = me >= distance ? counts[me - distance] : 0;
        barrier();
        counts[me] += before;
        barrier();
    }
    const uint pairs = counts[1023];
    const uint begin = counts[me] - own;
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
    const float threshold =
        push.threshold_mm > 0.0 ? push.threshold_mm : max(kMinThreshold, 0.1 * sqrt(mean));
    frame = RansacFrame(pairs, min(push.references, pairs), threshold, 0);
}
