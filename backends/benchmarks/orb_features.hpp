// Features and matches of the stages orb and match on one thread, for the benchmarks.
#pragma once
#include <vector>

#include "backends/benchmarks/image_pairs.hpp"
#include "include/defrec_c.h"

namespace defrec::benchmarks {

struct OrbResult {
    std::vector<defrec_feature> features;
    std::vector<uint16_t> smoothed;  // the sub-stage, all levels
    double milliseconds;             // of processor time, median of `repeat` runs
};
OrbResult orb_features(const GrayImage& image, uint32_t capacity, int repeat);

// One record for each feature of the first image, by the stage's defaults.
std::vector<defrec_match> match_features(const std::vector<defrec_feature>& first,
                                         const std::vector<defrec_feature>& second);

}  // namespace defrec::benchmarks
