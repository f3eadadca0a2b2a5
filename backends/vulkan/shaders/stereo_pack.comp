// A half image as the search of stage stereo reads it: in a word four pixels of a column, minus
// 128, from row 4 q - radius on; 0 outside.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(constant_id = 0) const int kRadius = 4;
layout(std430, set = 0, binding = 0) readonly buffer Gray { uint8_t gray[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Words { int words[]; };

void main() {
    const int x = int(gl_GlobalInvocationID.x), q = int(gl_GlobalInvocationID.y);
    if (x >= push.half_width) return;
    int word = 0;
    for (int k = 0; k < 4; ++k) {
        const int y = 4 * q - kRadius + k;
        if (y >= 0 && y < push.half_height)
            word |= ((int(gray[y * push.half_width + x]) - 128) & 255) << (8 * k);
    }
    words[q * push.half_width + x] = word;
}
