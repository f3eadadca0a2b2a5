// Stage orb, section 3: 4 x 4 pixels per invocation, of all levels.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
#define PIXELS ivec4
#include "orb_circle.glsl"
layout(local_size_x = 32, local_size_y = 4) in;

layout(std430, set = 0, binding = 1) readonly buffer Pyramid { uint pyramid[]; };
layout(std430, set = 0, binding = 2) readonly buffer Masks { uint masks[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Scores { uint scores[]; };

layout(constant_id = 0) const uint kHasMask = 0;
layout(constant_id = 1) const bool kLook = false;  // whether there may be a corner before scoring

const int kRows = 2 * kCircleRadius + 1;

uvec3 pixels_at(int at) { return uvec3(pyramid[at - 1], pyramid[at], pyramid[at + 1]); }
uvec3 usable_at(int at) { return uvec3(masks[at - 1], masks[at], masks[at + 1]); }

// Scores of the four pixels in the middle of three words of 7 rows.
ivec4 score(uvec3 rows[kRows]) {
    ivec4 circle[16];
    [[unroll]] for (int i = 0; i < 16; ++i) circle[i] =
        bytes_from(rows[kCircleRadius + kCircle[i].y], 4 + kCircle[i].x);
    return corner_score(bytes_from(rows[kCircleRadius], 4), circle);
}
// Whether one of the pixels may be a corner: nine of a circle that follow one another are two or
// more of any four at equal distances.
bool may_be_corner(uvec3 rows[kRows]) {
    const ivec4 centre = bytes_from(rows[kCircleRadius], 4);
    ivec4 brighter = ivec4(0), darker = ivec4(0);
    [[unroll]] for (int i = 0; i < 16; i += 4) {
        const ivec4 difference =
            bytes_from(rows[kCircleRadius + kCircle[i].y], 4 + kCircle[i].x) - centre;
        brighter += ivec4(greaterThan(difference, ivec4(push.threshold)));
        darker += ivec4(lessThan(difference, ivec4(-push.threshold)));
    }
    return any(greaterThan(max(brighter, darker), ivec4(1)));
}
// 0 for pixels with one in the 7 x 7 round them that is not usable.
ivec4 usable(uvec3 rows[kRows]) {
    uvec3 column = rows[0];
    [[unroll]] for (int i = 1; i < kRows; ++i) column &= rows[i];
    ivec4 all = bytes_from(column, 1);
    [[unroll]] for (int first = 2; first <= 7; ++first) all &= bytes_from(column, first);
    return all;
}

void main() {
    const OrbLevel level = levels[gl_GlobalInvocationID.z];
    const int x_word = int(gl_GlobalInvocationID.x), first = 4 * int(gl_GlobalInvocationID.y);
    if (4 * x_word >= level.width || first >= level.height) return;
    const int end = min(first + 4, level.height);
    if (level.cells_x == 0 || 4 * x_word + 3 < kBorder || 4 * x_word >= level.width - kBorder) {
        for (int y = first; y < end; ++y) scores[word_at(level, x_word, y)] = 0;
        return;
    }
    const ivec4 x = 4 * x_word + ivec4(0, 1, 2, 3);
    const ivec4 between = ivec4(greaterThanEqual(x, ivec4(kBorder))) *
                          ivec4(lessThan(x, ivec4(level.width - kBorder)));
    uvec3 pixel_rows[kRows], usable_rows[kRows];  // from 3 above to 3 below the row in turn; the
                                                  // last is read in the loop
    [[unroll]] for (int i = 0; i < kRows - 1; ++i) {
        const int at =
            word_at(level, x_word, clamp(first - kCircleRadius + i, 0, level.height - 1));
        pixel_rows[i] = pixels_at(at);
        if (kHasMask != 0) usable_rows[i] = usable_at(at);
    }
    for (int y = first; y < end; ++y) {
        const int below = word_at(level, x_word, min(y + kCircleRadius, level.height - 1));
        pixel_rows[kRows - 1] = pixels_at(below);
        if (kHasMask != 0) usable_rows[kRows - 1] = usable_at(below);
        ivec4 found = ivec4(0);
        if (y >= kBorder && y < level.height - kBorder && (!kLook || may_be_corner(pixel_rows))) {
            found = between * score(pixel_rows);
            found *= ivec4(greaterThan(found, ivec4(push.threshold)));
            if (kHasMask != 0) found *= ivec4(notEqual(usable(usable_rows), ivec4(0)));
        }
        scores[word_at(level, x_word, y)] = packed(found);
        [[unroll]] for (int i = 0; i < kRows - 1; ++i) {
            pixel_rows[i] = pixel_rows[i + 1];
            if (kHasMask != 0) usable_rows[i] = usable_rows[i + 1];
        }
    }
}
