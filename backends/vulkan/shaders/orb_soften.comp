// Stage orb, section 1: level 0, 4 x 4 pixels per invocation; and the mask in the same shape, a
// byte 0 or 255.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(std430, set = 0, binding = 1) readonly buffer Gray { uint8_t gray[]; };
layout(std430, set = 0, binding = 2) readonly buffer Mask { uint8_t mask[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Pyramid { uint pyramid[]; };
layout(std430, set = 0, binding = 4) writeonly buffer Masks { uint masks[]; };

int row_of(OrbLevel level, int y) { return clamp(y, 0, level.height - 1) * push.stride; }

// The sums under 1 2 1 along the row.
ivec4 across(OrbLevel level, int x, int y) {
    const int row = row_of(level, y);
    int p[6];
    for (int i = 0; i < 6; ++i) p[i] = int(gray[row + clamp(x - 1 + i, 0, level.width - 1)]);
    return ivec4(p[0], p[1], p[2], p[3]) + 2 * ivec4(p[1], p[2], p[3], p[4]) +
           ivec4(p[2], p[3], p[4], p[5]);
}

uint usable(OrbLevel level, int x, int y) {
    ivec4 bytes;
    for (int i = 0; i < 4; ++i)
        bytes[i] = int(mask[row_of(level, y) + min(x + i, level.width - 1)]) != 0 ? 255 : 0;
    return packed(bytes);
}

void main() {
    const OrbLevel level = levels[0];
    const int x_word = int(gl_GlobalInvocationID.x), first = 4 * int(gl_GlobalInvocationID.y);
    const int x = 4 * x_word;
    if (x >= level.width || first >= level.height) return;
    ivec4 above = across(level, x, first - 1), here = across(level, x, first);
    for (int y = first; y < min(first + 4, level.height); ++y) {
        const ivec4 below = across(level, x, y + 1);
        pyramid[word_at(level, x_word, y)] = packed((above + 2 * here + below + 8) >> 4);
        if (given.mask != 0) masks[word_at(level, x_word, y)] = usable(level, x, y);
        above = here;
        here = below;
    }
}
