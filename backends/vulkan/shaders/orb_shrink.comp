// Stage orb, section 1: a level from the one before it, and its mask; 4 x 4 pixels per invocation,
// which come from 5 x 5.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
layout(constant_id = 0) const uint kLevel = 1;
layout(local_size_x = 32, local_size_y = 4) in;

layout(std430, set = 0, binding = 1) buffer Pyramid { uint pyramid[]; };
layout(std430, set = 0, binding = 2) buffer Masks { uint masks[]; };

// The words that hold pixels 5 x_word ... 5 x_word + 4 of a row. The last row stands for those
// behind it, whose pixels nobody keeps.
ivec2 source_words(OrbLevel source, int x_word, int y) {
    const int first = word_at(source, 5 * x_word >> 2, min(y, source.height - 1));
    return ivec2(first, first + 1);
}
// Five bytes from the one that pixel 5 x_word is: the first four, and the last four.
uvec2 shifted(uint low, uint high, int x_word) {
    const int by = 8 * (5 * x_word & 3);
    const uint first = by == 0 ? low : low >> by | high << (32 - by);
    const uint fifth = high >> by & 255u;
    return uvec2(first, first >> 8 | fifth << 24);
}
ivec4 across(OrbLevel source, int x_word, int y) {
    const ivec2 at = source_words(source, x_word, y);
    const uvec2 words = shifted(pyramid[at.x], pyramid[at.y], x_word);
    return ivec4(7, 5, 3, 1) * bytes_from(uvec3(words.x, 0, 0), 0) +
           ivec4(1, 3, 5, 7) * bytes_from(uvec3(words.y, 0, 0), 0);
}
uint usable_across(OrbLevel source, int x_word, int y) {
    const ivec2 at = source_words(source, x_word, y);
    const uvec2 words = shifted(masks[at.x], masks[at.y], x_word);
    return words.x & words.y;
}

void main() {
    const OrbLevel source = levels[kLevel - 1], level = levels[kLevel];
    const int x_word = int(gl_GlobalInvocationID.x), block = int(gl_GlobalInvocationID.y);
    if (4 * x_word >= level.width || 4 * block >= level.height) return;
    ivec4 upper = across(source, x_word, 5 * block);
    for (int phase = 0; phase < 4 && 4 * block + phase < level.height; ++phase) {
        const ivec4 lower = across(source, x_word, 5 * block + phase + 1);
        pyramid[word_at(level, x_word, 4 * block + phase)] =
            packed(((7 - 2 * phase) * upper + (1 + 2 * phase) * lower + 32) >> 6);
        upper = lower;
    }
    if (given.mask == 0) return;
    uint usable_above = usable_across(source, x_word, 5 * block);
    for (int phase = 0; phase < 4 && 4 * block + phase < level.height; ++phase) {
        const uint usable_below = usable_across(source, x_word, 5 * block + phase + 1);
        masks[word_at(level, x_word, 4 * block + phase)] = usable_above & usable_below;
        usable_above = usable_below;
    }
}
