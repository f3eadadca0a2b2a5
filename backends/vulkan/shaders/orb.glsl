// What the shaders of stage orb share. Levels stand one after the other; rows begin at words of 4
// pixels, whose pixels beyond the width mean nothing.
#extension GL_EXT_control_flow_attributes : require
#include "backends/stages/orb.hpp"
#include "orb_structs.h"
layout(std430, set = 0, binding = 0) readonly buffer Levels { OrbLevel levels[]; };

layout(push_constant) uniform Push {
    OrbConstants push;
    OrbGiven given;
};

int word_at(OrbLevel level, int x_word, int y) {
    return ((int(level.first) + y * level.stride) >> 2) + x_word;
}

// Four bytes, the first being byte `first` of the words.
ivec4 bytes_from(uvec3 words, int first) {
    ivec4 bytes;
    [[unroll]] for (int i = 0; i < 4; ++i) bytes[i] =
        int(words[(first + i) >> 2] >> (8 * ((first + i) & 3)) & 255u);
    return bytes;
}
uint packed(ivec4 bytes) {
    return uint(bytes.x) | uint(bytes.y) << 8 | uint(bytes.z) << 16 | uint(bytes.w) << 24;
}
