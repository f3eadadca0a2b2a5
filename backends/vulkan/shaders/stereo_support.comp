// Stage stereo, section 5.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(std430, set = 0, binding = 0) readonly buffer Checked { int16_t checked[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Supported { int16_t supported[]; };

void main() {
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    if (x >= push.half_width || y >= push.half_height) return;
    const int i = y * push.half_width + x, disparity = int(checked[i]);
    int agreeing = 0;
    if (disparity != kNoDisparity)
        for (int b = -4; b <= 4; b += 2)
            for (int a = -4; a <= 4; a += 2) {
                if (x + a < 0 || x + a >= push.half_width || y + b < 0 || y + b >= push.half_height)
                    continue;
                // A missing one differs by more than the range.
                if (abs(int(checked[i + b * push.half_width + a]) - disparity) <= kSupportRange)
                    ++agreeing;
            }
    supported[i] = int16_t(agreeing >= push.support ? disparity : kNoDisparity);
}
