// See context.hpp.
#include "sdk/device/context.hpp"

#include <algorithm>
#include <tuple>

namespace defrec {
namespace {

// Smaller is faster.
int speed_class(const LoadedPlugin::DeviceEntry& device) {
    if (device.id == "reference") return 5;
    if ((device.features & DEFREC_FEATURE_SOFTWARE) != 0) return 4;
    switch (device.kind) {
        case DEFREC_DEVICE_CUDA:
            return 0;
        case DEFREC_DEVICE_VULKAN:
            return 1;
        case DEFREC_DEVICE_CPU:
            return 2;
        default:
            return 3;
    }
}

std::string missing_stages(uint32_t missing) {
    std::string names;
    for (uint32_t stage = 0; stage < DEFREC_STAGE_COUNT_V1; ++stage)
        if (missing >> stage & 1) names += concat(names.empty() ? "" : ", ", stage_name(stage));
    return names;
}

}  // namespace

std::shared_ptr<Context> Context::create(const defrec_context_desc& desc) {
    auto context = std::make_shared<Context>();
    context->services_ = std::make_shared<const Services>(desc);
    context->candidates_ = load_plugins(context->services_, desc);
    context->list_devices();
    return context;
}

void Context::list_devices() {
    for (const PluginCandidate& candidate : candidates_) {
        if (candidate.plugin == nullptr) continue;
        for (size_t i = 0; i < candidate.plugin->devices().size(); ++i) {
            const std::string& id = candidate.plugin->devices()[i].id;
            const bool taken =
                std::any_of(devices_.begin(), devices_.end(),
                            [&](const DeviceEntry& other) { return other.description().id == id; });
            if (taken)
                log(DEFREC_LOG_WARNING, concat(candidate.path, ": its device ", id,
                                               " is left out: another plugin has one of that id"));
            else
                devices_.push_back({candidate.plugin, i});
        }
    }
    std::sort(devices_.begin(), devices_.end(), [](const DeviceEntry& a, const DeviceEntry& b) {
        const auto &left = a.description(), &right = b.description();
        return std::make_tuple(speed_class(left), std::string_view(left.id)) <
               std::make_tuple(speed_class(right), std::string_view(right.id));
    });
    for (const DeviceEntry& entry : devices_) {
        const LoadedPlugin::DeviceEntry& device = entry.description();
        device_infos_.push_back({sizeof(defrec_device_info), device.kind, device.id.c_str(),
                                 device.name.c_str(), device.driver.c_str(), device.memory_bytes,
                                 device.stages, device.features, device.conformance, 0});
    }
}

std::shared_ptr<Device> Context::open_device(const char* id, uint32_t stages) const {
    if (id == nullptr) {
        for (const DeviceEntry& entry : devices_)
            if ((stages & ~entry.description().stages) == 0) return open(entry);
        fail(DEFREC_ERROR_UNSUPPORTED, "none of the ", devices_.size(), " devices offers ",
             missing_stages(stages), why_missing());
    }
    std::string known;
    for (const DeviceEntry& entry : devices_) {
        const LoadedPlugin::DeviceEntry& device = entry.description();
        if (device.id != id) {
            known += concat(known.empty() ? "" : ", ", device.id);
            continue;
        }
        if ((stages & ~device.stages) != 0)
            fail(DEFREC_ERROR_UNSUPPORTED, "device ", device.id, " does not offer ",
                 missing_stages(stages & ~device.stages));
        return open(entry);
    }
    fail(DEFREC_ERROR_ARGUMENT, "no device is called \"", id,
         "\"; there are: ", known.empty() ? "none" : known, why_missing());
}

std::shared_ptr<Device> Context::open(const DeviceEntry& entry) {
    const LoadedPlugin::DeviceEntry& device = entry.description();
    return std::make_shared<Device>(entry.plugin, entry.index, device.id, device.stages);
}

std::string Context::why_missing() const {
    if (candidates_.empty()) return "; no plugin was found";
    std::string text;
    for (const PluginCandidate& candidate : candidates_)
        if (candidate.plugin == nullptr)
            text += concat("; a plugin was refused: ", candidate.reason);
    return text;
}

}  // namespace defrec
