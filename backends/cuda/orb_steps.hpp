// The steps of the stage orb on the device, in the order of docs/stages/orb.md; record_orb_corners
// is in orb_corners.cu, and so on. Not the stage: see orb.cu.
#pragma once
#include "backends/cuda/device/device.hpp"
#include "backends/cuda/device/recorder.hpp"
#include "backends/definition/orb_definition.hpp"

namespace defrec::cuda {

using orb::OrbConstants;
using orb::OrbLevel;

struct OrbLevels : OrbConstants {
    OrbLevel level[kOrbMaxLevels];
};

// What the device reads and writes.
struct OrbMemory {
    const uint8_t *gray, *mask;  // mask: nullptr where all is usable
    uint8_t *pyramid,
        *usable;        // usable: 1 or 0 for each pixel of the pyramid, without a mask not written
    uint32_t* corners;  // as out 5 has them
    uint16_t* keys;     // of each cell, 0: none. Read in runs of kOrbKeysAtOnce
    uint32_t* counts;   // of each key
    uint32_t* kept;     // cells of the features, in order
    uint32_t* feature_count;
    defrec_feature* features;
};
// A corner's key is its distance << 8 | its score: the larger, the sooner it is kept.
constexpr uint32_t kOrbKeys = (orb::kFarthest + 1) << 8, kOrbKeysAtOnce = 32;

void record_orb_pyramid(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory);
// scores: nullptr, or an image of zeros without gaps.
void record_orb_corners(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory,
                        uint8_t* scores);
// And keys with their counts, which are zeros before. distances: as out 6 has them, or nullptr.
void record_orb_distances(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory,
                          uint8_t* distances);
void record_orb_selection(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory);
// patterns: orb_patterns.
void record_orb_features(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory,
                         const uint32_t* patterns);
// For each orientation bin the tests, as the description looks them up.
std::vector<uint32_t> orb_patterns();
// Copies without gaps; either may be nullptr.
void record_orb_images(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory,
                       uint8_t* pyramid, uint16_t* smoothed);

}  // namespace defrec::cuda
