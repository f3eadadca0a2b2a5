// What the backend needs of the operating system: system_posix.cpp and system_windows.cpp.
#pragma once
#include <volk.h>

namespace defrec::vulkan {

// Loads the Vulkan loader, for ever, and from it volk's functions that need no instance.
VkResult load_loader();

// Has a child that the process makes by fork call it, before anything else of it does.
void call_in_forked_child(void (*function)());

}  // namespace defrec::vulkan
