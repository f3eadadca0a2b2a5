// What the shaders of stage orb share. Levels stand one after the other; rows begin at words of 4 pixels, whose pixels beyond the width
// mean nothing.
struct Level {
    int width, height;      // px
    int cells_x, cells_y;   // 0 where the border leaves nothing
    int stride;             // words of 4 pixels
    int first_word;
    int first_cell, first_pixel;  // where the levels stand without gaps
};
layout(std430, set = 0, binding = 0) readonly buffer Levels { Level levels[]; };

layout(push_constant) uniform Push {
    int levels, cells;  // cells: of all levels
    int cell, threshold, spacing, capacity;
    int stride, has_mask;  // of the gray image and the mask
    int exported;          // a bit for each optional output
} push;

const int kBorder = 17;  // px of a level without features

int word_at(Level level, int x_word, int y) { return level.first_word + y * level.stride + x_word; }

// Four bytes, the first being byte `first` of the words.
ivec4 bytes_from(uvec3 words, int first) {
    ivec4 bytes;
    for (int i = 0; i < 4; ++i) bytes[i] = int(words[(first + i) >> 2] >> (8 * ((first + i) & 3)) & 255u);
    return bytes;
}
uint packed(ivec4 bytes) { return uint(bytes.x) | uint(bytes.y) << 8 | uint(bytes.z) << 16 | uint(bytes.w) << 24; }
