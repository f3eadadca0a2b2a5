// What a VkResult means as a status of the plugin ABI.
#pragma once
#include <volk.h>

#include <string>

#include "backends/shared/stage.hpp"

namespace defrec::vulkan {

inline void check(VkResult result, const char* call) {
    if (result >= 0) return;
    const std::string text = std::string(call) + " failed with VkResult " + std::to_string(result);
    switch (result) {
        case VK_ERROR_OUT_OF_HOST_MEMORY:
        case VK_ERROR_OUT_OF_DEVICE_MEMORY:
            throw StageError(DEFREC_ERROR_OUT_OF_MEMORY, text + ": out of memory");
        case VK_ERROR_DEVICE_LOST:
            throw StageError(DEFREC_ERROR_DEVICE_LOST, text + ": the device was lost");
        default:
            throw StageError(DEFREC_ERROR_INTERNAL, text);
    }
}

}  // namespace defrec::vulkan
