// See relayed.hpp.
#include "conformance/cases/stress/relayed.hpp"

#include "conformance/worker/failure.hpp"
#include "sdk/base/os/platform.hpp"

namespace defrec::conformance {

std::string relay_manifest() {
    // The reference lies beside libdefrec, and the relay in a folder there.
    const std::string beside = find_backend("reference").manifest;
    const std::string path = beside.substr(0, platform::name_start(beside)) +
                             "defrec-conformance/defrec_plugin_relay.json";
    require(platform::path_kind(path) != platform::PathKind::kMissing,
            "the suite's relay plugin is missing: ", path);
    return path;
}

void arm_relay(const Plugin& target, RelayPlan plan) {
    static const RelayArm arm = [] {
        void* library = open_plugin_library(find_plugin(relay_manifest()).library);
        return reinterpret_cast<RelayArm>(platform::find_symbol(library, "defrec_relay_arm"));
    }();
    require(arm != nullptr, "the suite's relay plugin does not export defrec_relay_arm");
    plan.target = target.entry();
    arm(plan);
}

ContextHandle open_relayed_context(const Plugin& target, const RelayPlan& plan,
                                   defrec_context_desc desc) {
    arm_relay(target, plan);
    return open_context(relay_manifest(), desc);
}

ContextHandle open_relayed_context(const Plugin& target, const RelayPlan& plan) {
    arm_relay(target, plan);
    return open_context(relay_manifest());
}

}  // namespace defrec::conformance
