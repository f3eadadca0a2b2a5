// A context: the application's callbacks, the plugins that were found and the devices they offer.
#pragma once
#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "sdk/base/os/services.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/device/device.hpp"
#include "sdk/plugin/loader.hpp"

namespace defrec {

// A device that a context offers; keeps its plugin.
class DeviceChoice {
  public:
    DeviceChoice(std::shared_ptr<const LoadedPlugin> plugin, size_t index)
        : plugin_(std::move(plugin)), index_(index) {}

    const LoadedPlugin::DeviceEntry& description() const { return plugin_->devices()[index_]; }
    bool is_quarantined() const { return plugin_->is_quarantined(index_); }
    const std::shared_ptr<const Services>& services() const { return plugin_->services(); }
    // Trackers of this context, made or being made.
    std::atomic<size_t>& tracker_count() const { return plugin_->tracker_count(index_); }
    // Throws Error(DEFREC_ERROR_DEVICE_LOST) where it is quarantined.
    std::shared_ptr<Device> open(std::shared_ptr<DeviceWatch> watch = nullptr) const;
    // A thread is stuck in a call of its plugin, and is left there. The error that says so.
    Error give_up(const char* call) const;

  private:
    std::shared_ptr<const LoadedPlugin> plugin_;
    size_t index_;  // in the plugin's devices()
};

// What a call may take, best first. The first `equal` of them are what it asked for.
struct DeviceSelection {
    std::vector<DeviceChoice> devices;
    size_t equal = 1;
};

// Counts as a tracker of a device as long as it lives. Movable.
class DeviceLoan {
  public:
    DeviceLoan() = default;
    explicit DeviceLoan(const DeviceChoice& device)
        : device_(std::make_unique<DeviceChoice>(device)) {
        ++device_->tracker_count();
    }
    ~DeviceLoan() {
        if (device_ != nullptr) --device_->tracker_count();
    }
    DeviceLoan(DeviceLoan&&) = default;
    DeviceLoan& operator=(DeviceLoan&& other) noexcept {
        std::swap(device_, other.device_);
        return *this;
    }

    const DeviceChoice& device() const { return *device_; }

  private:
    std::unique_ptr<DeviceChoice> device_;
};

// Any thread. But for what is counted immutable once made.
class Context {
  public:
    // Looks for plugins, loads them and orders their devices. A plugin that is refused is no
    // failure. Throws Error.
    static std::shared_ptr<Context> create(const defrec_context_desc& desc);

    Context() = default;
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    // The device of that id ("BACKEND:*": all of that backend, nullptr: the first one), and behind
    // it every other that offers all stages of the mask (bits 1 << DEFREC_STAGE_*). Throws
    // Error(DEFREC_ERROR_ARGUMENT) for an unknown id, Error(DEFREC_ERROR_UNSUPPORTED) where stages
    // are missing.
    DeviceSelection choose_device(const char* id, uint32_t stages) const;
    // Takes the next device out of a selection that is not empty: of the equal ones the one with
    // the fewest trackers that is not quarantined, the first among several.
    DeviceLoan lend(DeviceSelection& selection) const;

    const std::vector<PluginCandidate>& candidates() const { return candidates_; }
    bool has_plugins() const;
    size_t device_count() const { return device_infos_.size(); }
    // As of now.
    defrec_device_info device_info(size_t index) const;

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
    void list_devices();
    // Why a device may be missing, to be put behind an error message that says so; "" where every
    // plugin was loaded.
    std::string why_missing() const;

    std::shared_ptr<const Services> services_;
    std::vector<PluginCandidate> candidates_;
    std::vector<DeviceChoice> devices_;
    std::vector<defrec_device_info> device_infos_;
    mutable std::mutex lending_;
};

}  // namespace defrec
