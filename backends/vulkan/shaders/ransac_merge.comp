// Stage ransac: each match's weight over the accepted references, one invocation per landmark.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "ransac.glsl"
#include "nearest_rotation.glsl"
#include "ransac_choice.glsl"
const uint kSize = 64;
layout(local_size_x = kSize) in;

layout(std430, set = 0, binding = 4) readonly buffer PairOf { uint pair_of[]; };
layout(std430, set = 0, binding = 5) readonly buffer Matches { Match matches[]; };
layout(std430, set = 0, binding = 6) writeonly buffer Weighted { Match weighted[]; };

// What every invocation needs of each reference, for as many of them as there are invocations.
shared bool accepted[kSize];
shared mat3 rotations[kSize];
shared vec3 from_origin[kSize], to_origin[kSize];

void load_reference(uint place, uint k, uint needed) {
    accepted[place] = k < frame.references && hypotheses[k].support >= needed;
    if (!accepted[place]) return;
    rotations[place] = rotation_of(k);
    from_origin[place] = from[hypotheses[k].origin].xyz;
    to_origin[place] = to[hypotheses[k].origin].xyz;
}

void main() {
    const uint me = gl_LocalInvocationIndex, i = gl_GlobalInvocationID.x;
    const uint pair = i < push.landmarks ? pair_of[i] : kNone;
    vec3 a = vec3(0), b = vec3(0);
    if (pair != kNone) {
        a = from[pair].xyz;
        b = to[pair].xyz;
    }
    const uint needed = needed_support(best_reference(me, kSize));
    float weight = 0.0;
    for (uint first = 0; first < frame.references; first += kSize) {
        load_reference(me, first + me, needed);
        barrier();
        for (uint k = 0; k < min(frame.references - first, kSize); ++k)
            if (accepted[k])
                weight = max(weight, weight_at(length_of(b - to_origin[k] -
                                                         turned(rotations[k], a - from_origin[k])),
                                               frame.threshold));
        barrier();
    }
    if (i >= push.landmarks) return;
    Match match = matches[i];
    match.weight = pair != kNone && weight >= kKeptWeight ? weight : 0.0;
    weighted[i] = match;
}
