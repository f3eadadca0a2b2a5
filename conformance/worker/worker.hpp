// The process that loads the plugins and runs cases.
#pragma once
#include <span>

#include "conformance/worker/case.hpp"
#include "conformance/worker/child_process.hpp"

namespace defrec::conformance {

struct Step {
    uint32_t one;         // index of the case
    uint32_t repetition;  // from 0
};

// Who is examined.
struct Examination {
    PluginFiles subject, reference;
    std::string device_id;  // of the subject; empty: its first
};

// Loads the plugins, runs the steps in their order, and tells of each; the step behind the last is
// the end of the plugins' life.
void run_worker(const Examination& who, std::span<const Case> cases, std::span<const Step> steps,
                const MessageSender& sender);

// One repetition of one case, whatever its body throws.
RunResult run_case(const Case& one, Workbench& bench, const Tolerances& tolerances);

}  // namespace defrec::conformance
