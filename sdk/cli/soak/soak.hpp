// A long run with all that a day of use brings: cuts, losses, gaps, new templates, trackers that
// come and go, several threads. It counts and measures; scripts/soak judges what it prints.
#pragma once

#include <cstdint>
#include <string>

#include "sdk/cli/bench/bench.hpp"

namespace defrec::cli {

struct SoakOptions {
    BenchOptions bench;  // scene, its size, device, threads
    double minutes = 10;
    double speed = 1;            // of the video, 1: 30 frames a second; 0: without a pause
    double interval_s = 1;       // between two lines
    int players = 1;             // that make a new tracker every few frames
    double trackers_per_s = 20;  // made and destroyed beside that, without a frame
    bool grows = false;          // templates do
    // Manifest of a plugin whose device is lost in a stage's first run; each second one is. Empty:
    // none is.
    std::string losing_plugin;
};

// Prints a head and then a line of CSV for each interval. Throws CliError for the first call that
// failed.
void soak(const SoakOptions& options);

}  // namespace defrec::cli
