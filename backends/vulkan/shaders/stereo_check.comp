// Stage stereo, section 4: which winners are disparities. stereo_statistics.comp has looked at the
// left pixels.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(std430, set = 0, binding = 0) readonly buffer LeftKeys { int left_keys[]; };
layout(std430, set = 0, binding = 1) readonly buffer Seconds { int seconds[]; };
layout(std430, set = 0, binding = 2) readonly buffer RightKeys { int right_keys[]; };
layout(std430, set = 0, binding = 3) readonly buffer LeftUsable { uint8_t left_usable[]; };
layout(std430, set = 0, binding = 4) readonly buffer RightMask { uint8_t right_mask[]; };
layout(std430, set = 0, binding = 5) writeonly buffer Checked { int16_t checked[]; };

float score(int key) { return intBitsToFloat(key & ~255); }

void main() {
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    if (x >= push.half_width || y >= push.half_height) return;
    const int i = y * push.half_width + x, key = left_keys[i];
    int disparity = kNoDisparity;
    if (key != 0 && int(left_usable[i]) != 0) {
        const int d = push.first + (key & 255);
        precise const float lead = score(key) - score(seconds[i]);
        const bool alone = score(key) >= push.min_score && lead >= push.min_lead;
        const bool agrees = abs((right_keys[i - d] & 255) - (key & 255)) <= push.left_right;
        if (alone && agrees && int(right_mask[i - d]) != 0) disparity = 16 * d;
    }
    checked[i] = int16_t(disparity);
}
