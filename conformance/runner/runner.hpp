// Runs cases against a plugin, each several times, in child processes, and puts together what they
// found.
#pragma once
#include <chrono>
#include <functional>
#include <span>
#include <vector>

#include "conformance/worker/record.hpp"
#include "conformance/worker/worker.hpp"

namespace defrec::conformance {

inline constexpr uint32_t kRepetitions = 3;
// Repetitions of the short list: enough to compare, and to come after other cases.
inline constexpr uint32_t kSmokeRepetitions = 2;
// The case that the runner itself adds, without a body: that the plugin's life ends well in a
// process that ran the others.
Case end_of_process_case();

struct RunSettings {
    uint64_t seed = 1;  // of the order
    uint32_t repetitions = kRepetitions;
    std::chrono::seconds time_limit{
        120};  // of one repetition; ten times as long for slow cases, and for loading
    bool in_process =
        false;  // no child processes, no time limits: for tools that look at one process
    // Told before each repetition, for whoever watches; may be empty.
    std::function<void(size_t done, size_t total, const std::string& id)> progress;
};

struct RunOutcome {
    std::string refusal;  // not empty: the plugin or its device cannot be examined, and there is
                          // nothing else
    DeviceDescription device;
    std::vector<CaseRecord> cases;  // in the order of the cases given, and the end of the process
};

// Every repetition of every case, shuffled.
std::vector<Step> shuffled_steps(size_t cases, uint32_t repetitions, uint64_t seed);

// The record of a case from its repetitions, in their order.
CaseRecord merge(const Case& one, std::span<const RunResult> results, bool repeatable);

RunOutcome run_cases(const Examination& who, std::span<const Case> cases,
                     const RunSettings& settings);

}  // namespace defrec::conformance
