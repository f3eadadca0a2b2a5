// Stage rectify, section 3, along columns: the mask.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "rectify.glsl"
layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, set = 0, binding = 0) readonly buffer State { uint8_t state[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Mask { uint8_t mask[]; };

void main() {
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    if (x >= push.width || y >= push.height) return;
    int seen = 0;
    for (int v = max(y - push.highlight_radius, 0);
         v <= min(y + push.highlight_radius, push.height - 1); ++v)
        seen |= int(state[v * push.width + x]);
    const bool usable = (int(state[y * push.width + x]) & kCovered) != 0 && (seen & kNear) == 0;
    mask[y * push.stride + x] = uint8_t(usable ? 255 : 0);
}
