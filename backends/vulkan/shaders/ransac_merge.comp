// Stage ransac: each match's weight over the accepted references, one invocation per landmark.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "ransac.glsl"
#include "nearest_rotation.glsl"
#include "ransac_choice.glsl"
layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 4) readonly buffer PairOf { uint pair_of[]; };
layout(std430, set = 0, binding = 5) readonly buffer Matches { Match matches[]; };
layout(std430, set = 0, binding = 6) writeonly buffer Weighted { Match weighted[]; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.landmarks) return;
    float weight = 0.0;
    const uint pair = pair_of[i];
    if (pair != kNone) {
        const uint needed = needed_support(best_reference());
        for (uint k = 0; k < frame.references; ++k) {
            if (hypotheses[k].support < needed) continue;
            const uint origin = hypotheses[k].origin;
            const vec3 a = from[pair].xyz - from[origin].xyz, b = to[pair].xyz - to[origin].xyz;
            weight =
                max(weight, weight_at(length_of(b - turned(rotation_of(k), a)), frame.threshold));
        }
    }
    Match match = matches[i];
    match.weight = weight >= kKeptWeight ? weight : 0.0;
    weighted[i] = match;
}
