// Which depth map of the Hamlyn heart phantom belongs to a frame.
#pragma once

#include <cstdint>

namespace defrec::cli {

inline constexpr int kHeartPhantomMaps = 20;  // of one beat
inline constexpr double kHeartPhantomVideoFps = 25, kHeartPhantomMapsPerSecond = 30;
// Seconds from the first depth map to the first frame of f7 (from a user's code; the data set says
// nothing).
inline constexpr double kHeartPhantomPhase = 0.0933;

// frame: from 0. phase: seconds, 0 or more.
inline int heart_phantom_map(std::int64_t frame, double phase) {
    const double time = static_cast<double>(frame) / kHeartPhantomVideoFps + phase;
    return static_cast<int>(static_cast<std::int64_t>(kHeartPhantomMapsPerSecond * time) %
                            kHeartPhantomMaps);
}

}  // namespace defrec::cli
