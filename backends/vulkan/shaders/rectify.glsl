// What the shaders of stage rectify share. An invocation has four pixels of a row.
#include "backends/stages/rectify.hpp"
#include "rectify_push.h"
layout(push_constant) uniform Push {
    RectifyConstants push;
    RectifyGiven given;
};

// Bits of a pixel's state, a byte; those of four pixels share a word. Rows begin at words.
const uint kCovered = 1, kSaturated = 2;

int state_words() { return (push.width + 3) >> 2; }
