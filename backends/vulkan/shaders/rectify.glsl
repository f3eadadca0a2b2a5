// What the shaders of stage rectify share.
#include "backends/stages/rectify.hpp"
#include "rectify_push.h"
layout(push_constant) uniform Push {
    RectifyConstants push;
    RectifyGiven given;
};

// Of a pixel's state.
const int kCovered = 1, kSaturated = 2,
          kNear = 4;  // kNear: a saturated pixel of its row lies within the radius
