// Loads one plugin after its manifest and its file have been checked, or says in one error message
// why not.
#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "include/defrec_plugin.h"
#include "sdk/base/os/descriptor.hpp"
#include "sdk/base/os/services.hpp"
#include "sdk/plugin/host.hpp"
#include "sdk/plugin/manifest.hpp"

namespace defrec {

// A plugin's table in minor version 0; what comes behind is asked for with DEFREC_HAS.
constexpr uint32_t kMinTableSize =
    offsetof(defrec_plugin, buffer_import) + sizeof defrec_plugin::buffer_import;
constexpr size_t kMaxDevices = 64;  // of one plugin

// A plugin's instance for one context: its table, the host that it was given and its devices. Shut
// down by the destructor; the code stays in the process (docs/backends/plugins.md says why).
class LoadedPlugin {
  public:
    struct DeviceEntry {
        size_t index = 0;  // the plugin's own
        std::string id, name, driver;
        uint32_t kind = 0, stages = 0, features = 0, conformance = 0;
        uint64_t memory_bytes = 0;
    };

    // path: the library, absolute; file: the same, already checked. Throws Error with the reason of
    // the refusal.
    LoadedPlugin(std::shared_ptr<const Services> services, const std::string& path,
                 const Descriptor& file, const PluginManifest& manifest);
    ~LoadedPlugin();
    LoadedPlugin(const LoadedPlugin&) = delete;
    LoadedPlugin& operator=(const LoadedPlugin&) = delete;

    const std::string& name() const { return name_; }
    const std::shared_ptr<const Services>& services() const { return services_; }
    const defrec_plugin& table() const { return *table_; }
    // Those that the plugin could describe.
    const std::vector<DeviceEntry>& devices() const { return devices_; }
    // The others, each with the plugin's reason, as one error message; "" where there are none.
    const std::string& left_out() const { return left_out_; }
    // A device that did not answer is opened no more. device: of devices(). Logs it the first time.
    void quarantine(size_t device, const char* call) const noexcept;
    bool is_quarantined(size_t device) const { return quarantined_[device]; }
    // Trackers on a device of devices(), counted by DeviceLoan.
    std::atomic<size_t>& tracker_count(size_t device) const { return trackers_[device]; }
    // Checked when the plugin was loaded; nullptr where no device claimed the stage.
    const defrec_stage_table* stage_table(uint32_t stage) const {
        return stage < stages_.size() ? stages_[stage] : nullptr;
    }

  private:
    void enter(const std::string& path, const Descriptor& file);
    void check_table(const std::string& path, const PluginManifest& manifest) const;
    void list_devices(const std::string& path);
    // Nothing where the plugin says that it cannot; left_out_ then has the reason.
    std::optional<DeviceEntry> describe_device(const std::string& path, size_t index);
    void read_stage(const std::string& path, uint32_t stage);
    void shut_down() noexcept;

    std::shared_ptr<const Services> services_;
    std::string name_;
    PluginHostData host_data_;
    defrec_host host_;
    const defrec_plugin* table_ = nullptr;
    std::vector<DeviceEntry> devices_;
    std::string left_out_;
    std::array<const defrec_stage_table*, DEFREC_STAGE_COUNT_V1> stages_{};
    mutable std::array<std::atomic<bool>, kMaxDevices> quarantined_{};
    mutable std::array<std::atomic<size_t>, kMaxDevices> trackers_{};
};

// A manifest that was looked at.
struct PluginCandidate {
    std::string name, path, version;  // name: the manifest's, or its file name where it has none
    defrec_status verdict = DEFREC_OK;
    std::string reason;                          // of the refusal; when loaded, left_out()
    std::shared_ptr<const LoadedPlugin> plugin;  // null when refused
};

// Every candidate in the order of the search. Never throws for a bad plugin; std::bad_alloc only.
std::vector<PluginCandidate> load_plugins(const std::shared_ptr<const Services>& services,
                                          const defrec_context_desc& desc);

}  // namespace defrec
