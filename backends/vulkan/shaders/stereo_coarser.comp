// Stage stereo, section 6: makes the field that is coarser than push.level.
#version 450
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "stereo_pyramid.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

void main() {
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    const Level fine = level_at(push.level), coarse = level_at(push.level + 1);
    if (x < coarse.width && y < coarse.height)
        pyramid[coarse.offset + y * coarse.width + x] = int16_t(coarser_value(fine, x, y));
}
