// A small job of each stage, with everything in it, for cases that are not about results.
#pragma once
#include "conformance/worker/stage_job.hpp"

namespace defrec::conformance {

// seed: another of the same parameters and sizes.
StageJob sample_job(uint32_t stage, uint64_t seed = 1);

// How many inputs and outputs a run of the stage takes at most, and how many of them it cannot do
// without (the first ones).
struct BufferCounts {
    size_t min_in, max_in, min_out, max_out;
};
BufferCounts buffer_counts(uint32_t stage);

}  // namespace defrec::conformance
