// Costs of the elastic body beneath the surface: until it is ready, in frames, and for points.
#pragma once
#include "sdk/cli/bench/bench.hpp"

namespace defrec::cli {

// options.beneath: how many targets. Fewer frames than asked for after an interruption. Throws
// CliError.
BodyTimes measure_body(const BenchOptions& options, const BenchSequence& sequence);

nlohmann::ordered_json body_json(const BodyTimes& times);

}  // namespace defrec::cli
