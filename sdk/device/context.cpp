// See context.hpp.
#include "sdk/device/context.hpp"

#include <algorithm>
#include <tuple>

#include "backends/stages/list.hpp"

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

// "cuda:0" and "cuda" are of "cuda:*".
bool is_of_backend(std::string_view id, std::string_view asked) {
    if (!asked.ends_with(":*")) return false;
    const std::string_view backend = asked.substr(0, asked.size() - 2);
    return id.substr(0, id.find(':')) == backend;
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

// What the plugins still give back is the application's, but for threads that were left behind.
Context::~Context() {
    if (services_ == nullptr) return;
    devices_.clear();
    candidates_.clear();
    services_->end_callbacks();
}

void Context::list_devices() {
    for (const PluginCandidate& candidate : candidates_) {
        if (candidate.plugin == nullptr) continue;
        for (size_t i = 0; i < candidate.plugin->devices().size(); ++i) {
            const std::string& id = candidate.plugin->devices()[i].id;
            const bool taken = std::any_of(
                devices_.begin(), devices_.end(),
                [&](const DeviceChoice& other) { return other.description().id == id; });
            if (taken)
                log(DEFREC_LOG_WARNING, concat(candidate.path, ": its device ", id,
                                               " is left out: another plugin has one of that id"));
            else
                devices_.emplace_back(candidate.plugin, i);
        }
    }
    std::sort(devices_.begin(), devices_.end(), [](const DeviceChoice& a, const DeviceChoice& b) {
        const auto &left = a.description(), &right = b.description();
        return std::make_tuple(speed_class(left), std::string_view(left.id)) <
               std::make_tuple(speed_class(right), std::string_view(right.id));
    });
    for (const DeviceChoice& choice : devices_) {
        const LoadedPlugin::DeviceEntry& device = choice.description();
        device_infos_.push_back({sizeof(defrec_device_info), device.kind, device.id.c_str(),
                                 device.name.c_str(), device.driver.c_str(), device.memory_bytes,
                                 device.stages, device.features, device.conformance, 0});
    }
}

DeviceSelection Context::choose_device(const char* id, uint32_t stages) const {
    const std::string_view asked = id != nullptr ? id : "";
    std::vector<DeviceChoice> wanted, others;
    std::string known, lacking;
    for (const DeviceChoice& choice : devices_) {
        const LoadedPlugin::DeviceEntry& device = choice.description();
        const bool is_wanted = device.id == asked || is_of_backend(device.id, asked);
        const bool offers_all = (stages & ~device.stages) == 0;
        if (offers_all)
            (is_wanted ? wanted : others).push_back(choice);
        else if (is_wanted && lacking.empty())
            lacking = concat("device ", device.id, " does not offer ",
                             missing_stages(stages & ~device.stages));
        known += concat(known.empty() ? "" : ", ", device.id);
    }
    if (id != nullptr && wanted.empty() && !lacking.empty())
        fail(DEFREC_ERROR_UNSUPPORTED, lacking);
    if (id != nullptr && wanted.empty())
        fail(DEFREC_ERROR_ARGUMENT, "no device is called \"", id,
             "\"; there are: ", known.empty() ? "none" : known, why_missing());
    if (wanted.empty() && others.empty())
        fail(DEFREC_ERROR_UNSUPPORTED, "none of the ", devices_.size(), " devices offers ",
             missing_stages(stages), why_missing());
    DeviceSelection selection{std::move(wanted), 1};
    selection.equal = std::max<size_t>(selection.devices.size(), 1);
    selection.devices.insert(selection.devices.end(), others.begin(), others.end());
    return selection;
}

DeviceLoan Context::lend(DeviceSelection& selection) const {
    const std::lock_guard lock(lending_);  // two trackers made at once see each other
    const auto least = std::min_element(
        selection.devices.begin(),
        selection.devices.begin() + static_cast<std::ptrdiff_t>(selection.equal),
        [](const DeviceChoice& left, const DeviceChoice& right) {
            return std::make_tuple(left.is_quarantined(), left.tracker_count().load()) <
                   std::make_tuple(right.is_quarantined(), right.tracker_count().load());
        });
    DeviceLoan loan(*least);
    selection.devices.erase(least);
    selection.equal = std::max<size_t>(selection.equal - 1, 1);
    return loan;
}

bool Context::has_plugins() const {
    return std::any_of(
        candidates_.begin(), candidates_.end(),
        [](const PluginCandidate& candidate) { return candidate.plugin != nullptr; });
}

defrec_device_info Context::device_info(size_t index) const {
    defrec_device_info info = device_infos_[index];
    if (devices_[index].is_quarantined()) info.features |= DEFREC_FEATURE_QUARANTINED;
    return info;
}

std::shared_ptr<Device> DeviceChoice::open(std::shared_ptr<DeviceWatch> watch) const {
    if (is_quarantined())
        fail(DEFREC_ERROR_DEVICE_LOST, "device ", description().id,
             " is quarantined, because it did not answer before; choose another device");
    return std::make_shared<Device>(plugin_, index_, std::move(watch));
}

Error DeviceChoice::give_up(const char* call) const {
    plugin_->quarantine(index_, call);
    plugin_->services()->leave_behind();
    return Error(DEFREC_ERROR_DEVICE_LOST,
                 concat("device ", description().id, ": ", call, ": no answer within ",
                        services()->plugin_deadline().count(), " ms; the device is quarantined"));
}

std::string Context::why_missing() const {
    if (candidates_.empty()) return "; no plugin was found";
    std::string text;
    for (const PluginCandidate& candidate : candidates_)
        if (candidate.plugin == nullptr)
            text += concat("; a plugin was refused: ", candidate.reason);
        else if (!candidate.reason.empty())
            text += concat("; ", candidate.reason);
    return text;
}

}  // namespace defrec
