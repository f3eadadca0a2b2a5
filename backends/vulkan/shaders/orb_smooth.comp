// Stage orb, section 2: 4 x 4 pixels per invocation, of all levels.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(std430, set = 0, binding = 1) readonly buffer Pyramid { uint pyramid[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Smoothed {
    uvec2 smoothed[];
};  // 16 bits for each pixel

// The sums under 1 4 6 4 1 along the row. Only pixels within 2 px of the edge, which are 0, take
// from beyond it.
ivec4 across(OrbLevel level, int x_word, int y) {
    const int at = word_at(level, x_word, clamp(y, 0, level.height - 1));
    const uvec3 words = uvec3(pyramid[max(at - 1, 0)], pyramid[at], pyramid[at + 1]);
    return bytes_from(words, 2) + bytes_from(words, 6) +
           4 * (bytes_from(words, 3) + bytes_from(words, 5)) + 6 * bytes_from(words, 4);
}

void main() {
    const OrbLevel level = levels[gl_GlobalInvocationID.z];
    const int x_word = int(gl_GlobalInvocationID.x), first = 4 * int(gl_GlobalInvocationID.y);
    if (4 * x_word >= level.width || first >= level.height) return;
    const ivec4 x = 4 * x_word + ivec4(0, 1, 2, 3);
    const bvec4 left = lessThan(x, ivec4(kSmoothRadius)),
                right = greaterThanEqual(x, ivec4(level.width - kSmoothRadius));
    const ivec4 kept = ivec4(not(left)) * ivec4(not(right)) * (level.cells_x > 0 ? 1 : 0);
    ivec4 above2 = across(level, x_word, first - 2), above = across(level, x_word, first - 1);
    ivec4 here = across(level, x_word, first), below = across(level, x_word, first + 1);
    for (int y = first; y < min(first + 4, level.height); ++y) {
        const ivec4 below2 = across(level, x_word, y + 2);
        const bool inside = y >= kSmoothRadius && y < level.height - kSmoothRadius;
        const uvec4 sum =
            uvec4(inside ? kept * (above2 + below2 + 4 * (above + below) + 6 * here) : ivec4(0));
        smoothed[word_at(level, x_word, y)] = uvec2(sum.x | sum.y << 16, sum.z | sum.w << 16);
        above2 = above;
        above = here;
        here = below;
        below = below2;
    }
}
