// What every backend of ransac shares: which matches count, which of them are references, and which
// references are accepted. docs/stages/ransac.md explains it.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "backends/stages/ransac.hpp"

namespace defrec::ransac {

// Takes part: matched, with depth, finite.
constexpr bool usable(const defrec_landmark& landmark, const defrec_match& match) {
    bool finite = match.feature >= 0 && match.weight > 0.0f;
    for (int k = 0; k < 3; ++k)
        finite = finite && std::abs(landmark.position[k]) < kMaxCoordinateMm &&
                 std::abs(match.position[k]) < kMaxCoordinateMm;
    return finite;
}

// The counter-based generator: SplitMix64's output function (Steele, Lea, Flood 2014) of seed and
// counter.
constexpr uint64_t random_bits(uint64_t seed, uint64_t counter) {
    uint64_t z = seed + (counter + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

// Which of `count` usable matches reference k of `references` is: one from each of as many equal
// stretches.
constexpr uint32_t reference_index(uint64_t seed, uint32_t k, uint32_t references, uint32_t count) {
    const uint64_t first = uint64_t(k) * count / references,
                   last = uint64_t(k + 1) * count / references;
    return uint32_t(first + (((random_bits(seed, k) >> 32) * (last - first)) >> 32));
}

// The support that a reference needs, given that of the best one.
constexpr uint32_t needed_support(const defrec_ransac_params& params, uint32_t count,
                                  uint32_t best_support) {
    const uint32_t chance = params.min_support + count / kChanceDivisor;
    return std::max(chance, best_support / kBestDivisor);
}

}  // namespace defrec::ransac
