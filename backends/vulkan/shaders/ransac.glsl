// What the shaders of stage ransac share. docs/stages/ransac.md.
#include "records.glsl"

#include "backends/stages/ransac.hpp"
#include "ransac_structs.h"
layout(push_constant) uniform Push { RansacConstants push; };

const uint kNone = 0xffffffffu;

float weight_at(float distance, float threshold) {
    return distance > threshold ? threshold / distance : 1.0;
}
