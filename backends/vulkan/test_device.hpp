// The device that tests of the Vulkan backend run on, and its stages in the shape of host-memory
// backends.
#pragma once
#include <memory>

#include "backends/vulkan/stages.hpp"

namespace defrec::under_test {

namespace backend = vulkan;
constexpr const char* kBackend = "vulkan";

// False, with a message, where there is no device to test on.
bool available();
// With DEFREC_TEST_WIDE in the environment it counts as wide, and one without what that needs as
// none.
vulkan::Device& device();
// The same for tests that open it themselves.
const std::shared_ptr<const vulkan::Driver>& driver();
size_t device_index();
std::shared_ptr<vulkan::LogicalDevice> new_logical_device();

std::unique_ptr<Stage> in_host_memory(std::unique_ptr<vulkan::Stage> stage);

}  // namespace defrec::under_test

#include "backends/shared/test_device_makers.hpp"
