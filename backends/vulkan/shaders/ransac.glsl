// What the shaders of stage ransac share. docs/stages/ransac.md.
#include "records.glsl"

layout(push_constant) uniform Push {
    uint landmarks;   // in the template
    uint references;  // most
    uint iterations;
    uint min_support;
    float threshold;  // mm, 0: found from the frame
    uint seed_low, seed_high;
} push;

const float kKeptWeight = 0.8;
const float kMinThreshold = 1.0;  // mm
const uint kNone = 0xffffffffu;

// What the frame gave, found by the first shader.
struct Frame {
    uint pairs;       // matches that take part
    uint references;  // of them references
    float threshold;  // H, mm
    uint unused;
};
struct Hypothesis {
    vec4 rotation[3];  // rows
    uint origin;       // the pair it turns about
    uint support;
    uint unused[2];
};

float weight_at(float distance, float threshold) { return distance > threshold ? threshold / distance : 1.0; }
