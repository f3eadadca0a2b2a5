// How a case of the stage tier is written: what the stage is given, and how its results are
// compared. The rest is the same for all: stage_case.cpp.
#pragma once
#include <functional>
#include <vector>

#include "backends/stages/list.hpp"
#include "conformance/compare/compare_records.hpp"

namespace defrec::conformance {

struct StageCase {
    uint32_t stage = 0;
    std::string name, title;
    // frame 0: the one that is examined; frame 1: another of the same parameters and sizes, which
    // the stage sees in between.
    std::function<StageJob(CaseRun& run, uint32_t frame)> make;
    // found: all outputs of one run. compare_by_tolerance for float stages.
    std::function<void(CaseRun& run, const StageJob& job, const Expected& expected,
                       const std::vector<Bytes>& found)>
        compare;
    bool smoke = true, slow = false;
    // Throws CaseFailure where the reference's result shows that the case does not examine what it
    // is meant to; may be empty.
    std::function<void(const Expected& expected)> expects;
    SpreadOf spread = nullptr;  // of a float stage
    uint32_t since = 1;         // as Case has it
};

// Every case of the stage tier.
std::vector<StageCase> stage_cases();

// All outputs to the bit.
void compare_all_exactly(CaseRun& run, const StageJob& job, const Expected& expected,
                         const std::vector<Bytes>& found);

// A case whose results are held by the tolerances of the stage's quantities.
StageCase float_case(uint32_t stage, const char* name, const char* title,
                     std::function<StageJob(CaseRun&, uint32_t)> make, SpreadOf spread,
                     bool smoke = true, bool slow = false);

// The cases of each stage.
#define DEFREC_CASES(name, NAME) void add_##name##_cases(std::vector<StageCase>& cases);
DEFREC_STAGES(DEFREC_CASES, DEFREC_NOTHING)
#undef DEFREC_CASES
void add_ransac_in_place_case(std::vector<Case>& cases);

}  // namespace defrec::conformance
