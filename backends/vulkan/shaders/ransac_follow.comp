// Stage ransac: one work group for each reference alternates the rotation about it and the weights.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "ransac.glsl"
#include "ransac_sums.glsl"
#include "nearest_rotation.glsl"

layout(std430, set = 0, binding = 0) readonly buffer From { vec4 from[]; };
layout(std430, set = 0, binding = 1) readonly buffer To { vec4 to[]; };
layout(std430, set = 0, binding = 2) readonly buffer FrameBuffer { RansacFrame frame; };
layout(std430, set = 0, binding = 3) writeonly buffer Hypotheses { RansacHypothesis hypotheses[]; };

shared mat3 rotation;

// SplitMix64's output function (Steele, Lea, Flood 2014) of seed and counter.
uint64_t random_bits(uint64_t seed, uint counter) {
    uint64_t z = seed + uint64_t(counter + 1) * 0x9e3779b97f4a7c15ul;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ul;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebul;
    return z ^ (z >> 31);
}

// Which pair reference k is: one from each of as many equal stretches.
uint reference_index(uint k) {
    const uint64_t seed = (uint64_t(push.seed_high) << 32) | uint64_t(push.seed_low);
    const uint first = k * frame.pairs / frame.references,
               last = (k + 1) * frame.pairs / frame.references;
    return first + uint(((random_bits(seed, k) >> 32) * uint64_t(last - first)) >> 32);
}

void main() {
    const uint me = gl_LocalInvocationIndex, k = gl_WorkGroupID.x;
    const uint pairs = frame.pairs;
    if (k >= frame.references) return;
    const uint origin = reference_index(k);
    const vec3 a0 = from[origin].xyz, b0 = to[origin].xyz;
    for (uint iteration = 0; iteration <= push.iterations; ++iteration) {
        mat3 sum = mat3(0.0);
        const bool last = iteration == push.iterations;
        for (uint i = me; i < pairs; i += kSize) {
            const vec3 a = from[i].xyz - a0, b = to[i].xyz - b0;
            float weight = 1.0;
            if (iteration > 0) {
                const vec3 d = b - turned(rotation, a);
                const float distance = sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
                weight = weight_at(distance, frame.threshold);
                if (last) sum[0].x += distance < frame.threshold ? 1.0 : 0.0;
            }
            if (!last) sum += moment(weight * weight, b, a);
        }
        sum = sum_over_group(sum, me);
        if (me == 0) {
            if (last)
                hypotheses[k] = RansacHypothesis(
                    vec4[3](vec4(rotation[0], 0), vec4(rotation[1], 0), vec4(rotation[2], 0)),
                    origin, uint(sum[0].x), uint[2](0, 0));
            else
                rotation = nearest_rotation(sum);
        }
        barrier();
    }
}
