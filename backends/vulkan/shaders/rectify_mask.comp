// Stage rectify, section 3: the mask. An invocation has some rows of four pixels.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "rectify.glsl"
layout(local_size_x = 32, local_size_y = 4) in;
layout(constant_id = 0) const int kRows = 4;    // of an invocation
layout(constant_id = 1) const int kRadius = 2;  // of the highlights

layout(std430, set = 0, binding = 0) readonly buffer State { uint state[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Mask { uint8_t mask[]; };

// The bytes of a word that lie within the radius of each of four pixels, the word being so many
// words to the right of theirs.
uvec4 reached(int words_away) {
    uvec4 result;
    [[unroll]] for (int k = 0; k < 4; ++k) {
        const int first = max(k - kRadius - 4 * words_away, 0),
                  last = min(k + kRadius - 4 * words_away, 3);
        result[k] = first > last ? 0u : (~0u >> (8 * (3 - last + first))) << (8 * first);
    }
    return result;
}

void main() {
    const int x_word = int(gl_GlobalInvocationID.x), first = kRows * int(gl_GlobalInvocationID.y);
    const int words = state_words();
    if (x_word >= words || first >= push.height) return;
    uint own[kRows];
    bvec4 near[kRows];  // a saturated pixel
    [[unroll]] for (int j = 0; j < kRows; ++j) {
        own[j] = 0;
        near[j] = bvec4(false);
    }
    const int words_away = (kRadius + 3) / 4;
    for (int away = -words_away; away <= words_away; ++away) {
        const bool exists = x_word + away >= 0 && x_word + away < words;
        uint seen[kRows];  // of the rows within the radius
        [[unroll]] for (int j = 0; j < kRows; ++j) seen[j] = 0;
        for (int v = -kRadius; v < kRows + kRadius; ++v) {
            const int y = first + v;
            const uint four =
                exists && y >= 0 && y < push.height ? state[y * words + x_word + away] : 0u;
            [[unroll]] for (int j = 0; j < kRows; ++j) {
                if (abs(v - j) <= kRadius) seen[j] |= four;
                if (away == 0 && v == j) own[j] = four;
            }
        }
        const uvec4 reach = reached(away) & 0x01010101u * kSaturated;
        [[unroll]] for (int j = 0; j < kRows; ++j) {
            const bvec4 here = notEqual(reach & seen[j], uvec4(0));
            near[j] = bvec4(near[j].x || here.x, near[j].y || here.y, near[j].z || here.z,
                            near[j].w || here.w);
        }
    }
    [[unroll]] for (int j = 0; j < kRows; ++j) [[unroll]] for (int k = 0; k < 4; ++k) {
        if (first + j >= push.height || 4 * x_word + k >= push.width) continue;
        const bool usable = (own[j] >> (8 * k) & kCovered) != 0 && !near[j][k];
        mask[(first + j) * push.stride + 4 * x_word + k] = uint8_t(usable ? 255 : 0);
    }
}
