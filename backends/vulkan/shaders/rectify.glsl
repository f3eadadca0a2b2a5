// What the shaders of stage rectify share.
layout(push_constant) uniform Push {
    int width, height, stride;
    int source_width, source_height, source_stride;
    int saturation, radius;
    int has_map, has_ignore;
} push;

// Of a pixel's state.
const int kCovered = 1, kSaturated = 2, kNear = 4;  // kNear: a saturated pixel of its row lies within the radius
