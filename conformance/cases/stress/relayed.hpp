// A plugin seen through the relay (conformance/relay): the same devices, which fail or dawdle when
// told to.
#pragma once
#include <string>

#include "conformance/cases/sequence/tracking.hpp"
#include "conformance/relay/relay.hpp"
#include "conformance/worker/plugin.hpp"

namespace defrec::conformance {

// The relay's manifest, in its folder below libdefrec's. Throws CaseFailure where it is not
// installed.
std::string relay_manifest();

// What the next context with relay_manifest() that is opened on this thread does. plan.target is
// set here.
void arm_relay(const Plugin& target, RelayPlan plan);

// Both at once.
ContextHandle open_relayed_context(const Plugin& target, const RelayPlan& plan,
                                   defrec_context_desc desc);
ContextHandle open_relayed_context(const Plugin& target, const RelayPlan& plan);

}  // namespace defrec::conformance
