// A sequence that is held in memory, played to a tracker.
#pragma once
#include <chrono>

#include "sdk/cli/bench/bench.hpp"

namespace defrec::cli {

using BenchClock = std::chrono::steady_clock;
double milliseconds_since(BenchClock::time_point start);

// All that the trackers of a run are made with.
struct BenchSetup {
    Context context;
    Device device;
    Rig rig;
    defrec_tracker_desc desc;
};
// Throws CliError.
BenchSetup make_setup(const BenchOptions& options, const BenchSequence& sequence);

// A tracker that the sequence is played to, one frame after the other, to and fro. Throws CliError.
class Player {
  public:
    Player(const BenchOptions& options, const BenchSequence& sequence, const BenchSetup& setup,
           bool timed = false);
    // The time from submission to result, ms.
    double play();
    // The frame played last.
    const Job& job() const { return job_; }
    defrec_result result() const;

  private:
    const BenchSequence& sequence_;
    const std::uint64_t deadline_ns_;
    Tracker tracker_;
    Job job_;
    int step_ = 0;
};

}  // namespace defrec::cli
