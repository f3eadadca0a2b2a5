// `defrec evaluate`: runs the clips of a data set, each in a process of its own, and merges what
// they left.
#pragma once

#include <string>
#include <vector>

#include "sdk/evaluation/data_sets/data_set.hpp"

namespace defrec::cli {

// Part `number` of `count`: every count-th clip, beginning with clip number - 1.
struct Shard {
    std::size_t number = 1, count = 1;
};
// "1/4" to "4/4". Throws CliError(kUsage).
Shard parse_shard(const std::string& text);

struct EvaluateOptions {
    std::string data_set, root, out;
    std::vector<std::string> subset;  // patterns with * and ?; empty: all clips
    // Each is a variant; of defrec each config is, where there are any.
    std::vector<Method> methods{Method::kDefrec};
    std::vector<std::string> configs;
    RunSettings settings;  // but for method and config
    Shard shard;
    unsigned jobs = 1;           // clips at the same time
    double time_limit_s = 3600;  // of a clip
    bool is_sharded = false;     // run a shard, and merge nothing
    bool merge = false;          // run nothing
    bool list = false;           // print the names of the clips and do nothing
    bool resume = false;         // keep what is done
    bool quiet = false;
    std::string clip;  // not empty: this clip, in this process, into `out`
};

// Returns the exit code: 0; 6 when clips are in quarantine or doubtful, but
// for a shard; 130 when interrupted.
// Throws CliError.
int run_evaluate(const EvaluateOptions& options);

}  // namespace defrec::cli
