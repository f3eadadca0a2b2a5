// What the shaders of stage ransac leave to each other, for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#include "backends/vulkan/shaders/shader_types.hpp"
namespace defrec::vulkan {
#endif

// What the frame gave, found by the first shader.
struct RansacFrame {
    uint pairs;       // matches that take part
    uint references;  // of them references
    float threshold;  // H, mm
    uint unused;
};

struct RansacHypothesis {
    vec4 rotation[3];  // rows
    uint origin;       // the pair it turns about
    uint support;
    uint unused[2];
};

#ifdef __cplusplus
}  // namespace defrec::vulkan
#endif
