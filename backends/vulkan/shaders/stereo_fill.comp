// Stage stereo, section 6: fills the holes of push.level from the coarser field.
#version 450
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "stereo_pyramid.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

void main() {
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    const Level fine = level_at(push.level), coarse = level_at(push.level + 1);
    if (x >= fine.width || y >= fine.height) return;
    const int i = fine.offset + y * fine.width + x;
    if (int(pyramid[i]) != kNoDisparity) return;
    const int u = x >> 1, v = y >> 1, u2 = (x & 1) == 0 ? u - 1 : u + 1,
              v2 = (y & 1) == 0 ? v - 1 : v + 1;
    pyramid[i] = int16_t(filled(value(coarse, u, v), value(coarse, u2, v), value(coarse, u, v2),
                                value(coarse, u2, v2)));
}
