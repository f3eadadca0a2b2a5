// Stage rectify, section 3, along rows: sets kNear.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "rectify.glsl"
layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, set = 0, binding = 0) readonly buffer State { uint8_t state[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Next { uint8_t next[]; };

void main() {
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    if (x >= push.width || y >= push.height) return;
    const int row = y * push.width;
    int seen = 0;
    for (int u = max(x - push.highlight_radius, 0);
         u <= min(x + push.highlight_radius, push.width - 1); ++u)
        seen |= int(state[row + u]);
    next[row + x] = uint8_t(int(state[row + x]) | ((seen & kSaturated) != 0 ? kNear : 0));
}
