// The plugin `vulkan`: backends/vulkan behind the plugin ABI, one device for each that the Vulkan
// loader shows.
#include "plugins/base/plugin.hpp"

#include "backends/vulkan/shared_device.hpp"
#include "backends/vulkan/stages.hpp"

namespace defrec::vulkan {
constexpr auto kMakers = makers_of<DEFREC_STAGES(DEFREC_STAGE_MAKER, DEFREC_COMMA)>();
}  // namespace defrec::vulkan

namespace defrec {
namespace {

class VulkanBackend {
  public:
    using Device = vulkan::Device;
    using Buffer = vulkan::Buffer;
    using Queue = vulkan::Queue;
    using Stage = vulkan::RecordedStage;

    const char* name() const { return "vulkan"; }
    const char* version() const { return DEFREC_RELEASE; }
    size_t device_count() const { return driver_ == nullptr ? 0 : driver_->devices().size(); }
    bool offers(uint32_t) const { return true; }

    void describe(size_t index, defrec_device_info& info) const {
        const vulkan::PhysicalDevice& device = driver_->devices()[index];
        info.kind = DEFREC_DEVICE_VULKAN;
        info.id = device.id.c_str();
        info.name = device.name.c_str();
        info.driver = device.driver.c_str();
        info.memory_bytes = device.memory_bytes;
        // A device that lacks what the stages need is listed with none, so that nobody wonders
        // where it is.
        if (!device.lacks.empty()) info.stages = 0;
        info.features = DEFREC_FEATURE_REPEATABLE;
        if (device.software) info.features |= DEFREC_FEATURE_SOFTWARE;
    }
    std::unique_ptr<Device> open(size_t index) const {
        return std::make_unique<Device>(vulkan::shared_device(driver_, index));
    }

    Buffer make_buffer(Device& device, uint64_t size) const {
        Buffer buffer(device, size);
        device.clear(buffer);
        return buffer;
    }
    void* allocate_host(Device& device, uint64_t size) const { return device.allocate_host(size); }
    void release_host(Device& device, void* memory) const noexcept { device.release_host(memory); }

    Stage make_stage(Device& device, uint32_t stage, const void* params) const {
        return Stage(device, vulkan::kMakers[stage](params, device));
    }
    // Makers refuse what the device cannot do; what that takes is made and thrown away.
    void check_support(Device& device, uint32_t stage, const void* params) const {
        vulkan::kMakers[stage](params, device);
    }

  private:
    std::shared_ptr<const vulkan::Driver> driver_ =
        vulkan::shared_driver();  // nullptr: no loader, no devices
};

}  // namespace
}  // namespace defrec

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
    return defrec::enter_plugin<defrec::VulkanBackend>(host, out);
}
