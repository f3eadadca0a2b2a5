// What the command line of a run says.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "conformance/worker/case.hpp"
#include "conformance/worker/child_process.hpp"

namespace defrec::conformance {

struct RunOptions {
    std::string plugin, backend;  // one of the two
    std::string device;           // empty: the plugin's first
    std::string out;
    std::vector<std::string> tiers, cases;  // cases: ids or patterns with *; empty: all
    bool smoke = false, list = false, in_process = !kCanIsolate;
    uint32_t time_limit_s = 120;  // of one repetition of one case
    uint64_t seed = 1;
};

// The cases that the options name, in order. Throws Error where a name is of none.
std::vector<Case> select_cases(std::vector<Case> cases, const RunOptions& options);

}  // namespace defrec::conformance
