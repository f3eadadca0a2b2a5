// A compute shader as it is embedded in the library.
#pragma once
#include <cstdint>
#include <span>

namespace defrec::vulkan {

struct Shader {
    const char* name;
    std::span<const uint32_t> code;  // SPIR-V
};

}  // namespace defrec::vulkan
