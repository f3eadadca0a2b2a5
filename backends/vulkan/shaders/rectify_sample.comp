// Stage rectify, sections 1 and 2: gray and sampling. Sets kCovered and kSaturated of the pixels'
// states.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "rectify.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(constant_id = 0) const uint kFormat = 1;
layout(std430, set = 0, binding = 0) readonly buffer Source { uint source[]; };  // four bytes
layout(std430, set = 0, binding = 1) readonly buffer Map { ivec2 map[]; };
layout(std430, set = 0, binding = 2) readonly buffer Ignore { uint8_t ignore[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Gray { uint8_t gray[]; };
layout(std430, set = 0, binding = 4) writeonly buffer State { uint state[]; };

const int kBytes = kFormat == 1 ? 1 : kFormat == 4 ? 4 : 3;  // of a pixel

uint bytes_from(uint word, uint next, int byte) {
    return (word >> (8 * byte)) | ((next << 1) << (31 - 8 * byte));
}
// The bytes of the image from `at` on: of four pixels, or of the first `pixels`.
uvec4 load(int at, int pixels) {
    const int first = at >> 2, words = (pixels * kBytes + 3) / 4;
    uint next = source[first];
    uvec4 bytes = uvec4(0);
    [[unroll]] for (int i = 0; i < 4; ++i) if (i < words) {
        const uint word = next;
        next = source[first + i + 1];
        bytes[i] = bytes_from(word, next, at & 3);
    }
    return bytes;
}
int byte_of(uvec4 bytes, int i) { return int((bytes[i >> 2] >> (8 * (i & 3))) & 255u); }
int gray_of(uvec4 bytes, int pixel) {
    const int at = pixel * kBytes;
    if (kFormat == 1) return byte_of(bytes, at);
    const int first = byte_of(bytes, at), green = byte_of(bytes, at + 1),
              third = byte_of(bytes, at + 2);
    const int red = kFormat == 3 ? first : third, blue = kFormat == 3 ? third : first;
    return (kRedWeight * red + kGreenWeight * green + kBlueWeight * blue + 128) >> 8;
}

bool ignored(int x, int y) { return int(ignore[y * push.source_width + x]) != 0; }

// The pixel at x, y of the map: its gray, and its state.
void sample_mapped(int x, int y, out int value, out uint found) {
    const ivec2 from = map[y * push.width + x];
    const ivec2 last = ivec2(push.source_width, push.source_height) - 1;
    value = 0;
    found = 0;
    if (from.x < 0 || from.y < 0 || from.x > last.x * kMapOne || from.y > last.y * kMapOne) return;
    // In the last column and row the weights of what would lie beyond are 0.
    const ivec2 at = from >> 7, beyond = from & (kMapOne - 1), next = min(at + 1, last);
    const uvec4 above = load(at.y * push.source_stride + at.x * kBytes, 2),
                below = load(next.y * push.source_stride + at.x * kBytes, 2);
    const int top = (kMapOne - beyond.x) * gray_of(above, 0) + beyond.x * gray_of(above, 1);
    const int bottom = (kMapOne - beyond.x) * gray_of(below, 0) + beyond.x * gray_of(below, 1);
    value = ((kMapOne - beyond.y) * top + beyond.y * bottom + 8192) >> 14;
    const bool covered = given.ignore == 0 || !(ignored(at.x, at.y) || ignored(next.x, at.y) ||
                                                ignored(at.x, next.y) || ignored(next.x, next.y));
    found = (covered ? kCovered : 0) | (value >= push.saturation ? kSaturated : 0);
}

void main() {
    const int x_word = int(gl_GlobalInvocationID.x), x = 4 * x_word,
              y = int(gl_GlobalInvocationID.y);
    if (x >= push.width || y >= push.height) return;
    uvec4 bytes = uvec4(0);
    if (given.map == 0) bytes = load(y * push.source_stride + x * kBytes, 4);
    uint states = 0;
    [[unroll]] for (int k = 0; k < 4; ++k) {
        if (x + k >= push.width) continue;
        int value;
        uint found;
        if (given.map != 0) {
            sample_mapped(x + k, y, value, found);
        } else {
            value = gray_of(bytes, k);
            const bool covered = given.ignore == 0 || !ignored(x + k, y);
            found = (covered ? kCovered : 0) | (value >= push.saturation ? kSaturated : 0);
        }
        gray[y * push.stride + x + k] = uint8_t(value);
        states |= found << (8 * k);
    }
    state[y * state_words() + x_word] = states;
}
