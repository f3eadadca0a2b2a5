// Stage ransac: the best reference's motion, fitted to the matches that follow it, and the summary.
// One work group.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "ransac.glsl"
#include "ransac_sums.glsl"
#include "nearest_rotation.glsl"
#include "ransac_choice.glsl"

layout(std430, set = 0, binding = 4) readonly buffer Weighted { Match weighted[]; };
layout(std430, set = 0, binding = 5) writeonly buffer Summary { RansacSummary summary; };

shared mat3 rotation;
shared vec3 translation;

void main() {
    const uint me = gl_LocalInvocationIndex;
    const uint pairs = frame.pairs;
    const uint best = best_reference(me, kSize);
    const uint needed = needed_support(best);
    const bool accepted = frame.references > 0 && hypotheses[best].support >= needed;

    mat3 counts = mat3(0.0);
    for (uint i = me; i < push.landmarks; i += kSize)
        counts[0].x += weighted[i].weight > 0.5 ? 1.0 : 0.0;
    for (uint k = me; k < frame.references; k += kSize)
        counts[0].y += hypotheses[k].support >= needed ? 1.0 : 0.0;
    counts = sum_over_group(counts, me);
    if (me == 0) {
        rotation = accepted ? rotation_of(best) : mat3(1.0);
        const uint origin = accepted ? hypotheses[best].origin : 0;
        translation = accepted ? to[origin].xyz - turned(rotation, from[origin].xyz) : vec3(0);
    }
    barrier();

    float support = 0.0;
    for (int round = 0; accepted && round <= kRefinements; ++round) {
        // Means first, then moments about them: in single precision moments about 0 lose what they
        // are to tell.
        mat3 mean = mat3(0.0);
        for (uint i = me; i < pairs; i += kSize) {
            const vec3 a = from[i].xyz, b = to[i].xyz;
            if (!(length_of(b - turned(rotation, a) - translation) < frame.threshold)) continue;
            mean += mat3(a, b, vec3(1, 0, 0));
        }
        mean = sum_over_group(mean, me);
        support = mean[2].x;
        if (round == kRefinements || support == 0.0) break;
        const vec3 a0 = mean[0] / support, b0 = mean[1] / support;
        mat3 moments = mat3(0.0);
        for (uint i = me; i < pairs; i += kSize) {
            const vec3 a = from[i].xyz, b = to[i].xyz;
            if (length_of(b - turned(rotation, a) - translation) < frame.threshold)
                moments += moment(1.0, b - b0, a - a0);
        }
        moments = sum_over_group(moments, me);
        if (me == 0) {
            rotation = nearest_rotation(moments);
            translation = b0 - turned(rotation, a0);
        }
        barrier();
    }
    if (me != 0) return;
    summary = RansacSummary(
        int(pairs), frame.references > 0 ? int(counts[0].y) : 0, int(counts[0].x), int(support),
        float[9](rotation[0].x, rotation[0].y, rotation[0].z, rotation[1].x, rotation[1].y,
                 rotation[1].z, rotation[2].x, rotation[2].y, rotation[2].z),
        float[3](translation.x, translation.y, translation.z));
}
