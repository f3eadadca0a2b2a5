// See system.hpp.
#include <pthread.h>

#include "backends/vulkan/system.hpp"

namespace defrec::vulkan {

VkResult load_loader() { return volkInitialize(); }

void call_in_forked_child(void (*function)()) { pthread_atfork(nullptr, nullptr, function); }

}  // namespace defrec::vulkan
