// Stage stereo, section 9.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(std430, set = 0, binding = 0) readonly buffer Half { int16_t half_field[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Hypothesis { int16_t hypothesis[]; };

int at_half(int u, int v) {
    return int(half_field[clamp(v, 0, push.half_height - 1) * push.half_width +
                          clamp(u, 0, push.half_width - 1)]);
}

void main() {
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    if (x >= push.width || y >= push.height) return;
    const int u = x >> 1, v = y >> 1, u2 = (x & 1) == 0 ? u - 1 : u + 1,
              v2 = (y & 1) == 0 ? v - 1 : v + 1;
    const int a = at_half(u, v), b = at_half(u2, v), c = at_half(u, v2), d = at_half(u2, v2);
    const bool one_surface =
        max(max(a, b), max(c, d)) - min(min(a, b), min(c, d)) <= kUpsampleRange;
    const int result = a == kNoDisparity ? kNoDisparity
                       : one_surface     ? (9 * a + 3 * b + 3 * c + d + 4) >> 3
                                         : 2 * a;
    hypothesis[y * push.width + x] = int16_t(result);
}
