// Stage ransac: the best reference's motion, fitted to the matches that follow it, and the summary. One work group.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "ransac.glsl"
#include "ransac_sums.glsl"
#include "nearest_rotation.glsl"
#include "ransac_choice.glsl"

layout(std430, set = 0, binding = 4) readonly buffer Weighted { Match weighted[]; };
layout(std430, set = 0, binding = 5) writeonly buffer Summary { RansacSummary summary; };

const int kRefinements = 4;

shared mat3 rotation;
shared vec3 translation;

const float kZeros[9] = float[9](0, 0, 0, 0, 0, 0, 0, 0, 0);

void main() {
    const uint me = gl_LocalInvocationIndex;
    const uint pairs = frame.pairs;
    const uint best = best_reference();
    const uint needed = needed_support(best);
    const bool accepted = frame.references > 0 && hypotheses[best].support >= needed;

    float counts[9] = kZeros;
    for (uint i = me; i < push.landmarks; i += kSize) counts[0] += weighted[i].weight > 0.5 ? 1.0 : 0.0;
    for (uint k = me; k < frame.references; k += kSize) counts[1] += hypotheses[k].support >= needed ? 1.0 : 0.0;
    sum_over_group(counts, me);
    if (me == 0) {
        rotation = accepted ? rotation_of(best) : mat3(1.0);
        const uint origin = accepted ? hypotheses[best].origin : 0;
        translation = accepted ? to[origin].xyz - turned(rotation, from[origin].xyz) : vec3(0);
    }
    barrier();

    float support = 0.0;
    for (int round = 0; accepted && round <= kRefinements; ++round) {
        // Means first, then moments about them: in single precision moments about 0 lose what they are to tell.
        float mean[9] = kZeros;
        for (uint i = me; i < pairs; i += kSize) {
            const vec3 a = from[i].xyz, b = to[i].xyz;
            if (!(length_of(b - turned(rotation, a) - translation) < frame.threshold)) continue;
            mean[0] += 1.0;
            for (int j = 0; j < 3; ++j) {
                mean[1 + j] += a[j];
                mean[4 + j] += b[j];
            }
        }
        sum_over_group(mean, me);
        support = mean[0];
        if (round == kRefinements || support == 0.0) break;
        const vec3 a0 = vec3(mean[1], mean[2], mean[3]) / support, b0 = vec3(mean[4], mean[5], mean[6]) / support;
        float moment[9] = kZeros;
        for (uint i = me; i < pairs; i += kSize) {
            const vec3 a = from[i].xyz, b = to[i].xyz;
            if (length_of(b - turned(rotation, a) - translation) < frame.threshold) add_moment(moment, 1.0, b - b0, a - a0);
        }
        sum_over_group(moment, me);
        if (me == 0) {
            rotation = nearest_rotation(as_matrix(moment));
            translation = b0 - turned(rotation, a0);
        }
        barrier();
    }
    if (me != 0) return;
    summary = RansacSummary(int(pairs), frame.references > 0 ? int(counts[1]) : 0, int(counts[0]), int(support),
                            float[9](rotation[0].x, rotation[0].y, rotation[0].z, rotation[1].x, rotation[1].y, rotation[1].z,
                                     rotation[2].x, rotation[2].y, rotation[2].z),
                            float[3](translation.x, translation.y, translation.z));
}
