// Stage stereo, section 3: what a score needs to know of each window of a half image. Of the left
// image also the first checks of section 4; for the right one the winners' keys are cleared.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"

layout(constant_id = 0) const int kRadius = 4;
#include "stereo_windows.glsl"
layout(constant_id = 1) const bool kRight = false;
layout(std430, set = 0, binding = 0) readonly buffer Gray { uint8_t gray[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Statistics {
    vec2 statistics[];
};  // mean, or right sum; root of the variance
layout(std430, set = 0, binding = 2) buffer LeftUsable { uint8_t left_usable[]; };
layout(std430, set = 0, binding = 3) writeonly buffer RightKeys { int right_keys[]; };

int power = 1;

int cell(ivec2 at) {
    if (any(lessThan(at, ivec2(0))) || at.x >= push.half_width || at.y >= push.half_height)
        return 0;
    const int value = int(gray[at.y * push.half_width + at.x]) - 128;
    return power == 1 ? value : value * value;
}

void main() {
    const int n = (2 * kRadius + 1) * (2 * kRadius + 1);
    const ivec2 first = first_of_run();
    int sums[kRun], squares[kRun];
    sum_windows(sums);
    power = 2;
    sum_windows(squares);
    for (int j = 0; j < kRun; ++j) {
        const ivec2 at = first + ivec2(0, j);
        if (at.x >= push.half_width || at.y >= push.half_height) continue;
        const ivec2 end = ivec2(push.half_width, push.half_height) - kRadius;
        const bool whole = all(greaterThanEqual(at, ivec2(kRadius))) && all(lessThan(at, end));
        const int sum = whole ? sums[j] : 0, variance = whole ? n * squares[j] - sum * sum : 0;
        const int i = at.y * push.half_width + at.x;
        precise const float mean = float(sum) * push.one_over_n;
        statistics[i] = vec2(kRight ? float(sum) : mean, inverse_root(variance));
        if (kRight)
            right_keys[i] = 0;
        else if (!has_texture(variance, n))
            left_usable[i] = uint8_t(0);
    }
}
