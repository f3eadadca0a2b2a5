// Stage rectify, sections 1 and 2: gray and sampling, one invocation per pixel of the result. Sets
// kCovered and kSaturated of its state.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "rectify.glsl"
layout(local_size_x = 32, local_size_y = 8) in;

layout(constant_id = 0) const uint kFormat = 1;
layout(std430, set = 0, binding = 0) readonly buffer Source { uint8_t source[]; };
layout(std430, set = 0, binding = 1) readonly buffer Map { ivec2 map[]; };
layout(std430, set = 0, binding = 2) readonly buffer Ignore { uint8_t ignore[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Gray { uint8_t gray[]; };
layout(std430, set = 0, binding = 4) writeonly buffer State { uint8_t state[]; };

int source_gray(int x, int y) {
    if (kFormat == 1) return int(source[y * push.source_stride + x]);
    const int at = y * push.source_stride + x * (kFormat == 4 ? 4 : 3);
    const int first = int(source[at]), green = int(source[at + 1]), third = int(source[at + 2]);
    const int red = kFormat == 3 ? first : third, blue = kFormat == 3 ? third : first;
    return (77 * red + 150 * green + 29 * blue + 128) >> 8;
}

bool ignored(int x, int y) { return int(ignore[y * push.source_width + x]) != 0; }

void main() {
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    if (x >= push.width || y >= push.height) return;
    const ivec2 from = given.map != 0 ? map[y * push.width + x] : ivec2(x, y) * kMapOne;
    const ivec2 last = ivec2(push.source_width, push.source_height) - 1;
    int value = 0, found = 0;
    if (from.x >= 0 && from.y >= 0 && from.x <= last.x * kMapOne && from.y <= last.y * kMapOne) {
        const int i = from.x >> 7, j = from.y >> 7;
        const int a = from.x & (kMapOne - 1), b = from.y & (kMapOne - 1);
        const int right = min(i + 1, last.x), below = min(j + 1, last.y);
        if (given.map != 0) {
            const int top = (kMapOne - a) * source_gray(i, j) + a * source_gray(right, j);
            const int bottom =
                (kMapOne - a) * source_gray(i, below) + a * source_gray(right, below);
            value = ((kMapOne - b) * top + b * bottom + 8192) >> 14;
        } else {
            value = source_gray(i, j);
        }
        bool covered = true;
        if (given.ignore != 0) {
            covered = !ignored(i, j);
            if (given.map != 0)
                covered =
                    covered && !ignored(right, j) && !ignored(i, below) && !ignored(right, below);
        }
        found = (covered ? kCovered : 0) | (value >= push.saturation ? kSaturated : 0);
    }
    gray[y * push.stride + x] = uint8_t(value);
    state[y * push.width + x] = uint8_t(found);
}
