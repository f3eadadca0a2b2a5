// Stage stereo, the end of section 10: speckles go.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
const int kRadius = 4;
#include "stereo_windows.glsl"

layout(std430, set = 0, binding = 0) readonly buffer From { int16_t from[]; };
layout(std430, set = 0, binding = 1) buffer Confidence { uint8_t confidence[]; };
layout(std430, set = 0, binding = 2) writeonly buffer To { int16_t to[]; };

int cell(ivec2 at) {
    if (any(lessThan(at, ivec2(0))) || at.x >= push.width || at.y >= push.height) return 0;
    return int(from[at.y * push.width + at.x]) != kNoDisparity ? 1 : 0;
}

void main() {
    const ivec2 first = first_of_run();
    int counts[kRun];
    sum_windows(counts);
    for (int j = 0; j < kRun; ++j) {
        const bool dropped = 25 * counts[j] < 81 * push.support;
        const ivec2 at = first + ivec2(0, j);
        if (at.x >= push.width || at.y >= push.height) continue;
        const int i = at.y * push.width + at.x;
        to[i] = int16_t(dropped ? kNoDisparity : int(from[i]));
        if (dropped) confidence[i] = uint8_t(0);
    }
}
