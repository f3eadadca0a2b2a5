// See test_device.hpp.
#include "backends/vulkan/test_device.hpp"

#include <doctest/doctest.h>

#include <cstdlib>

#include "backends/shared/test_in_host_memory.hpp"

namespace defrec::under_test {
namespace {

struct Types {
    using Device = vulkan::Device;
    using Buffer = vulkan::Buffer;
    using Queue = vulkan::Queue;
    using Stage = vulkan::RecordedStage;
};

struct Opened {
    std::shared_ptr<const vulkan::Driver> driver = vulkan::Driver::open();
    size_t index = 0;
    std::unique_ptr<vulkan::Device> device;
    const char* lacks = "device";  // what there is none of, where there is no `device`
    Opened() {
        if (driver == nullptr) return;
        while (index < driver->devices().size() && !driver->devices()[index].lacks.empty()) ++index;
        if (index < driver->devices().size())
            device = std::make_unique<vulkan::Device>(
                std::make_shared<vulkan::LogicalDevice>(driver, index));
        if (std::getenv("DEFREC_TEST_WIDE") == nullptr || device == nullptr) return;
        if (device->physical().packed_dot) {
            device->set_wide(true);
        } else {
            lacks = "device with packed dot products";
            device = nullptr;
        }
    }
};
Opened& opened() {
    static Opened result;
    return result;
}

}  // namespace

bool available() {
    if (opened().device == nullptr) MESSAGE("skipped: no Vulkan ", opened().lacks);
    return opened().device != nullptr;
}

vulkan::Device& device() {
    if (opened().device == nullptr) throw StageError(DEFREC_ERROR_UNSUPPORTED, "no Vulkan device");
    return *opened().device;
}

const std::shared_ptr<const vulkan::Driver>& driver() { return opened().driver; }
size_t device_index() { return opened().index; }
std::shared_ptr<vulkan::LogicalDevice> new_logical_device() {
    return std::make_shared<vulkan::LogicalDevice>(driver(), device_index());
}

std::unique_ptr<Stage> in_host_memory(std::unique_ptr<vulkan::Stage> stage) {
    return std::make_unique<test::InHostMemory<Types>>(device(), std::move(stage));
}

}  // namespace defrec::under_test
