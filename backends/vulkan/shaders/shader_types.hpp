// GLSL's types as C++ sees them, for the headers that both include.
#pragma once
#include <cstdint>

namespace defrec::vulkan {

using uint = uint32_t;
struct alignas(16) vec4 {
    float x, y, z, w;
};

}  // namespace defrec::vulkan
