// `defrec devices --verify`: each plugin is opened in a process of its own, so that one that aborts
// or hangs is reported instead of taking the program with it.
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace defrec::cli {

struct ProbeResult {
    std::string manifest;
    bool is_good = false;
    std::string message;               // what is wrong; when good, what was tried
    std::vector<std::string> devices;  // ids
};

// Runs `program devices --probe manifest` and waits for at most `limit`.
ProbeResult probe_in_child(const std::string& program, const std::string& manifest,
                           std::chrono::milliseconds limit);

// Likewise for all that the library looks at by itself: in DEFREC_PLUGIN_PATH, and beside
// libdefrec. What it refuses without opening it is among them.
std::vector<ProbeResult> probe_all(const std::string& program, std::chrono::milliseconds limit);

// The child's part: opens only this plugin, tracks one small frame on each of its devices and
// prints the outcome as one line of JSON. Returns the exit code.
int run_probe(const std::string& manifest);

}  // namespace defrec::cli
