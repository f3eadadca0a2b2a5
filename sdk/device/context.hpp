// A context: the application's callbacks, the plugins that were found and the devices they offer.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "sdk/base/error.hpp"
#include "sdk/base/services.hpp"
#include "sdk/device/device.hpp"
#include "sdk/plugin/loader.hpp"

namespace defrec {

// Any thread. Immutable once made.
class Context {
  public:
    // Looks for plugins, loads them and orders their devices. A plugin that is refused is no
    // failure. Throws Error.
    static std::shared_ptr<Context> create(const defrec_context_desc& desc);

    // id nullptr: the first device that offers every stage of the mask (bits 1 << DEFREC_STAGE_*).
    // Throws Error(DEFREC_ERROR_ARGUMENT) for an unknown id, Error(DEFREC_ERROR_UNSUPPORTED) where
    // stages are missing.
    std::shared_ptr<Device> open_device(const char* id, uint32_t stages) const;

    const std::vector<PluginCandidate>& candidates() const { return candidates_; }
    const std::vector<defrec_device_info>& devices() const { return device_infos_; }

    // level: DEFREC_LOG_*. Source is "sdk".
    void log(int32_t level, const std::string& text) const noexcept {
        services_->log(level, "sdk", text.c_str());
    }
    const Services& services() const { return *services_; }
    // For ContextVector: ContextVector<float> values(count, context.allocator()).
    std::shared_ptr<const Services> allocator() const { return services_; }
    template <class Body>
    void parallel_for(size_t count, Body&& body) const noexcept {
        services_->parallel_for(count, std::forward<Body>(body));
    }

  private:
    struct DeviceEntry {
        std::shared_ptr<const LoadedPlugin> plugin;
        size_t index;  // the plugin's own
        const LoadedPlugin::DeviceEntry& description() const { return plugin->devices()[index]; }
    };
    static std::shared_ptr<Device> open(const DeviceEntry& entry);
    void list_devices();
    // Why a device may be missing, to be put behind an error message that says so; "" where every
    // plugin was loaded.
    std::string why_missing() const;

    std::shared_ptr<const Services> services_;
    std::vector<PluginCandidate> candidates_;
    std::vector<DeviceEntry> devices_;
    std::vector<defrec_device_info> device_infos_;
};

}  // namespace defrec
