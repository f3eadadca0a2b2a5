// The Vulkan loader, one instance, and the devices it shows. Without a loader or a driver there are
// none, which is no error.
#pragma once
#include <volk.h>

#include <memory>
#include <string>
#include <vector>

namespace defrec::vulkan {

struct PhysicalDevice {
    VkPhysicalDevice handle;
    std::string
        id;  // "vulkan:10de:2335", vendor and device as hexadecimal; ":1", ":2" behind those alike
    std::string name, driver;
    uint64_t memory_bytes;  // device-local
    bool software;          // lavapipe and its like: computed on the processor
    bool packed_dot;        // dot products of four bytes in a word
    uint32_t queue_family, queue_count;
    std::string lacks;  // what the stages need and it has not; empty if nothing
};

class Driver {
  public:
    // nullptr where there is no loader or no instance can be made.
    static std::shared_ptr<const Driver> open();
    ~Driver();
    Driver(const Driver&) = delete;
    Driver& operator=(const Driver&) = delete;

    const std::vector<PhysicalDevice>& devices() const { return devices_; }

  private:
    explicit Driver(VkInstance instance) : instance_(instance) {}
    void find_devices();
    VkInstance instance_;
    std::vector<PhysicalDevice> devices_;
};

}  // namespace defrec::vulkan
