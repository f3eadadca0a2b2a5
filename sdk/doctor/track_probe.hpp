// Frames given to a tracker, for what it says of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sdk/doctor/evidence.hpp"

namespace defrec::cli {

struct ProbeOptions {
    std::string backend = "auto", device;
    unsigned threads = 0;
    std::string config;  // empty: the library's defaults
};

// calibration: what the library takes; nullptr: a nominal one takes its place, with which only the
// images say something. `refusal`: on return why the library refuses it, where it does.
TrackProbe track_frames(const ProbeOptions& options, const std::vector<StereoFrame>& frames,
                        const StereoCalibration* calibration, std::string& refusal);

}  // namespace defrec::cli
