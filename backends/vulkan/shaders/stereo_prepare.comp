// Stage stereo, sections 1 and 2: one image inpainted and halved, with its mask. A work group per
// tile of 32 x 32 pixels.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
const int kRadius = kInpaintRadius;
#include "stereo_windows.glsl"

layout(std430, set = 0, binding = 0) readonly buffer Source { uint8_t source[]; };
layout(std430, set = 0, binding = 1) readonly buffer Mask { uint8_t mask[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Gray { uint8_t gray[]; };
layout(std430, set = 0, binding = 3) writeonly buffer HalfGray { uint8_t half_gray[]; };
layout(std430, set = 0, binding = 4) writeonly buffer HalfMask { uint8_t half_mask[]; };

const int kOne = 1 << 20;  // a cell counts its pixel above the sum of grays

shared int any_masked;
shared int inpainted[kTile][kTile];  // -1 - gray where masked

bool inside(ivec2 at) {
    return all(greaterThanEqual(at, ivec2(0))) && at.x < push.width && at.y < push.height;
}
bool usable(ivec2 at) { return given.mask == 0 || int(mask[at.y * push.stride + at.x]) != 0; }
int source_gray(ivec2 at) { return int(source[at.y * push.stride + at.x]); }
int cell(ivec2 at) { return inside(at) && usable(at) ? kOne + source_gray(at) : 0; }

void main() {
    const ivec2 first = first_of_run(), place = ivec2(gl_LocalInvocationID) * ivec2(1, kRun);
    if (gl_LocalInvocationIndex == 0) any_masked = 0;
    barrier();
    for (int j = 0; j < kRun; ++j) {
        const ivec2 at = first + ivec2(0, j);
        int value = 0;
        if (inside(at)) {
            value = source_gray(at);
            if (!usable(at)) {
                value = -1;
                atomicOr(any_masked, 1);
            }
        }
        inpainted[place.y + j][place.x] = value;
    }
    barrier();
    if (any_masked != 0) {
        int sums[kRun];
        sum_windows(sums);
        for (int j = 0; j < kRun; ++j) {
            if (inpainted[place.y + j][place.x] >= 0) continue;
            const int sum = sums[j] & (kOne - 1), n = sums[j] >> 20;
            inpainted[place.y + j][place.x] = -1 - (n == 0 ? 128 : (2 * sum + n) / (2 * n));
        }
        barrier();
    }
    for (int j = 0; j < kRun; ++j) {
        const ivec2 at = first + ivec2(0, j);
        const int value = inpainted[place.y + j][place.x];
        if (inside(at)) gray[at.y * push.width + at.x] = uint8_t(value < 0 ? -1 - value : value);
    }
    for (int i = int(gl_LocalInvocationIndex); i < kTile * kTile / 4; i += kInvocations) {
        const ivec2 within = ivec2(i % (kTile / 2), i / (kTile / 2));
        const ivec2 at = ivec2(gl_WorkGroupID.xy) * (kTile / 2) + within;
        if (at.x >= push.half_width || at.y >= push.half_height) continue;
        int sum = 2, usable_pixels = 0;
        for (int k = 0; k < 4; ++k) {
            const int value = inpainted[2 * within.y + (k >> 1)][2 * within.x + (k & 1)];
            sum += value < 0 ? -1 - value : value;
            usable_pixels += value < 0 ? 0 : 1;
        }
        half_gray[at.y * push.half_width + at.x] = uint8_t(sum >> 2);
        half_mask[at.y * push.half_width + at.x] = uint8_t(usable_pixels == 4 ? 1 : 0);
    }
}
