// How a case of the stage tier is written: what the stage is given, and how its results are compared. The rest is the same for all:
// stage_case.cpp.
#pragma once
#include <functional>
#include <vector>

#include "conformance/compare.hpp"

namespace defrec::conformance {

struct StageCase {
    uint32_t stage = 0;
    std::string name, title;
    // frame 0: the one that is examined; frame 1: another of the same parameters and sizes, which the stage sees in between.
    std::function<StageJob(CaseRun& run, uint32_t frame)> make;
    // found: all outputs of one run.
    std::function<void(CaseRun& run, const StageJob& job, const Expected& expected, const std::vector<Bytes>& found)> compare;
    bool smoke = true, slow = false;
    // Throws CaseFailure where the reference's result shows that the case does not examine what it is meant to; may be empty.
    std::function<void(const Expected& expected)> expects;
};

void add_stage_case(std::vector<Case>& cases, StageCase one);

// All outputs to the bit.
void compare_all_exactly(CaseRun& run, const StageJob& job, const Expected& expected, const std::vector<Bytes>& found);

// The cases of each stage, and of each a job as the abi tier needs one: small, with everything in it.
void add_rectify_cases(std::vector<Case>& cases);
void add_stereo_cases(std::vector<Case>& cases);
void add_orb_cases(std::vector<Case>& cases);
void add_match_cases(std::vector<Case>& cases);
void add_align_cases(std::vector<Case>& cases);
void add_ransac_cases(std::vector<Case>& cases);
void add_lm_cases(std::vector<Case>& cases);
void add_warp_cases(std::vector<Case>& cases);

}  // namespace defrec::conformance
