// What all contexts of a process share: the driver, and a logical device for each physical one.
#pragma once
#include <memory>

#include "backends/vulkan/logical_device.hpp"

namespace defrec::vulkan {

// Driver::open's, as long as anybody uses it.
std::shared_ptr<const Driver> shared_driver();

// That of driver->devices()[index], which computes known answers as it should; made anew if nobody
// uses it, or if it was lost. Throws StageError.
std::shared_ptr<LogicalDevice> shared_device(const std::shared_ptr<const Driver>& driver,
                                             size_t index);

}  // namespace defrec::vulkan
