// Stage orb, section 1: a level from the one before it, and its mask; 4 x 4 pixels per invocation,
// which come from 5 x 5. Where a device waits long for a shader to start, the level after it too:
// five blocks of one are four of the next.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
layout(constant_id = 0) const uint kLevel = 1;
layout(constant_id = 1) const bool kTwo = false;
layout(constant_id = 2) const int kColumns = 32;
layout(constant_id = 3) const int kRows = 4;
layout(local_size_x_id = 2, local_size_y_id = 3) in;

layout(std430, set = 0, binding = 1) buffer Pyramid { uint pyramid[]; };
layout(std430, set = 0, binding = 2) buffer Masks { uint masks[]; };

// What the work group made of the first level, for the second.
shared uint made[kTwo ? 4 * kTwoRows : 1][kTwoColumns],
    made_masks[kTwo ? 4 * kTwoRows : 1][kTwoColumns];

// Where the pixels of the level that is shrunk come from, from the first word and row on.
struct Source {
    bool made;
    int first_word, last_row;  // of the whole level; the last row stands for those behind it, whose
                               // pixels nobody keeps
    int row_words;
};

uint word_of(Source source, int x_word, int y) {
    y = min(y, source.last_row);
    return source.made ? made[y][x_word]
                       : pyramid[source.first_word + y * source.row_words + x_word];
}
uint mask_of(Source source, int x_word, int y) {
    y = min(y, source.last_row);
    return source.made ? made_masks[y][x_word]
                       : masks[source.first_word + y * source.row_words + x_word];
}

// Five bytes from the one that pixel 5 x_word is: the first four, and the last four.
uvec2 shifted(uint low, uint high, int x_word) {
    const int by = 8 * (5 * x_word & 3);
    const uint first = by == 0 ? low : low >> by | high << (32 - by);
    const uint fifth = high >> by & 255u;
    return uvec2(first, first >> 8 | fifth << 24);
}
ivec4 across(Source source, int x_word, int y) {
    const int word = 5 * x_word >> 2;
    const uvec2 words = shifted(word_of(source, word, y), word_of(source, word + 1, y), x_word);
    return ivec4(7, 5, 3, 1) * bytes_from(uvec3(words.x, 0, 0), 0) +
           ivec4(1, 3, 5, 7) * bytes_from(uvec3(words.y, 0, 0), 0);
}
uint usable_across(Source source, int x_word, int y) {
    const int word = 5 * x_word >> 2;
    const uvec2 words = shifted(mask_of(source, word, y), mask_of(source, word + 1, y), x_word);
    return words.x & words.y;
}

// The block (x_word, block) from the source's first, of a level whose word for it is `at`, in so
// many rows.
void shrink(Source source, OrbLevel level, int x_word, int block, int at, int rows, bool keep) {
    ivec4 upper = across(source, x_word, 5 * block);
    for (int phase = 0; phase < min(rows, 4); ++phase) {
        const ivec4 lower = across(source, x_word, 5 * block + phase + 1);
        const uint four = packed(((7 - 2 * phase) * upper + (1 + 2 * phase) * lower + 32) >> 6);
        pyramid[at + phase * (level.stride >> 2)] = four;
        if (keep) made[4 * gl_LocalInvocationID.y + phase][gl_LocalInvocationID.x] = four;
        upper = lower;
    }
    if (given.mask == 0) return;
    uint usable_above = usable_across(source, x_word, 5 * block);
    for (int phase = 0; phase < min(rows, 4); ++phase) {
        const uint usable_below = usable_across(source, x_word, 5 * block + phase + 1);
        const uint four = usable_above & usable_below;
        masks[at + phase * (level.stride >> 2)] = four;
        if (keep) made_masks[4 * gl_LocalInvocationID.y + phase][gl_LocalInvocationID.x] = four;
        usable_above = usable_below;
    }
}

void main() {
    const OrbLevel source = levels[kLevel - 1], level = levels[kLevel];
    const int x_word = int(gl_GlobalInvocationID.x), block = int(gl_GlobalInvocationID.y);
    if (4 * x_word < level.width && 4 * block < level.height)
        shrink(Source(false, word_at(source, 0, 0), source.height - 1, source.stride >> 2), level,
               x_word, block, word_at(level, x_word, 4 * block), level.height - 4 * block, kTwo);
    if (!kTwo) return;
    barrier();
    const OrbLevel next = levels[kLevel + 1];
    const ivec2 local = ivec2(gl_LocalInvocationID.xy),
                tile = ivec2(gl_WorkGroupID.xy) * ivec2(kTwoColumns, kTwoRows) * 4 / 5,
                at = tile + local;
    if (local.x >= kTwoColumns * 4 / 5 || local.y >= kTwoRows * 4 / 5 || 4 * at.x >= next.width ||
        4 * at.y >= next.height)
        return;
    shrink(Source(true, 0, level.height - 1 - int(gl_WorkGroupID.y) * 4 * kTwoRows, 0), next,
           local.x, local.y, word_at(next, at.x, 4 * at.y), next.height - 4 * at.y, false);
}
