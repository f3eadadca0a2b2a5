// See system.hpp.
#include <windows.h>

#include "backends/vulkan/system.hpp"

namespace defrec::vulkan {

// volkInitialize would take one from the working folder or the path, too.
VkResult load_loader() {
    const HMODULE loader = LoadLibraryExW(L"vulkan-1.dll", nullptr, LOAD_LIBRARY_SEARCH_SYSTEM32);
    if (loader == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
    const auto entry = reinterpret_cast<void*>(GetProcAddress(loader, "vkGetInstanceProcAddr"));
    if (entry == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
    volkInitializeCustom(reinterpret_cast<PFN_vkGetInstanceProcAddr>(entry));
    return VK_SUCCESS;
}

// There is no fork.
void call_in_forked_child(void (*)()) {}

}  // namespace defrec::vulkan
