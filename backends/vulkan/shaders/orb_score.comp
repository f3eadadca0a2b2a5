// Stage orb, section 3: 4 pixels beside each other per invocation, of all levels.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
#define PIXELS ivec4
#include "orb_circle.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(std430, set = 0, binding = 1) readonly buffer Pyramid { uint pyramid[]; };
layout(std430, set = 0, binding = 2) readonly buffer Masks { uint masks[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Scores { uint scores[]; };

const int kRadius = 3;

ivec4 score(int at, int stride) {
    uvec3 rows[7];
    for (int i = 0; i < 7; ++i) {
        const int row = at + (i - kRadius) * stride;
        rows[i] = uvec3(pyramid[row - 1], pyramid[row], pyramid[row + 1]);
    }
    ivec4 circle[16];
    for (int i = 0; i < 16; ++i) circle[i] = bytes_from(rows[kRadius + kCircle[i].y], 4 + kCircle[i].x);
    return corner_score(bytes_from(rows[kRadius], 4), circle);
}

// 0 for pixels with one in the 7 x 7 round them that is not usable.
ivec4 usable(int at, int stride) {
    uvec3 column = uvec3(~0u);
    for (int i = -kRadius; i <= kRadius; ++i) {
        const int row = at + i * stride;
        column &= uvec3(masks[row - 1], masks[row], masks[row + 1]);
    }
    ivec4 all = bytes_from(column, 1);
    for (int first = 2; first <= 7; ++first) all &= bytes_from(column, first);
    return all;
}

void main() {
    const Level level = levels[gl_GlobalInvocationID.z];
    const int x_word = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    if (4 * x_word >= level.width || y >= level.height) return;
    const int at = word_at(level, x_word, y);
    ivec4 found = ivec4(0);
    if (level.cells_x > 0 && y >= kBorder && y < level.height - kBorder && 4 * x_word + 3 >= kBorder && 4 * x_word < level.width - kBorder) {
        const ivec4 x = 4 * x_word + ivec4(0, 1, 2, 3);
        found = score(at, level.stride);
        found *= ivec4(greaterThan(found, ivec4(push.threshold)));
        found *= ivec4(greaterThanEqual(x, ivec4(kBorder))) * ivec4(lessThan(x, ivec4(level.width - kBorder)));
        if (push.has_mask != 0) found *= ivec4(notEqual(usable(at, level.stride), ivec4(0)));
    }
    scores[at] = packed(found);
}
