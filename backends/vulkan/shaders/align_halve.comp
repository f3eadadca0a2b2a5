// Stage align, section 2: a level of the live image, or of its mask (0: not usable), one invocation
// per pixel.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "align_push.h"
#include "halving.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(constant_id = 0) const int kLevel = 1;
layout(constant_id = 1) const bool kMask = false;
layout(std430, set = 0, binding = 0) readonly buffer From { uint8_t from[]; };
layout(std430, set = 0, binding = 1) writeonly buffer To { uint8_t to[]; };
layout(push_constant) uniform Push { AlignLevelSize push; };

int halve(int a, int b, int c, int d) { return kMask ? least_of(a, b, c, d) : mean_of(a, b, c, d); }
int level0(int x, int y) { return int(from[y * push.stride + x]); }
HALVED(level1, level0, halve)
HALVED(level2, level1, halve)
HALVED(level3, level2, halve)

void main() {
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    if (x >= push.width || y >= push.height) return;
    to[y * push.width + x] = uint8_t(kLevel == 1   ? level1(x, y)
                                     : kLevel == 2 ? level2(x, y)
                                                   : level3(x, y));
}
