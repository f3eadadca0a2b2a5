// How much of a disparity image stages lm and warp can reach.
#pragma once
#include "backends/stages/surface.hpp"

namespace defrec::cpu {

// Lanes count the image's bytes in int32 (surface_lanes-inl.hpp).
template <class Params>
void check_disparity_bytes(const char* stage, const Params& params) {
    constexpr uint64_t kMaxElements = uint64_t{1} << 30;
    const uint64_t elements = disparity_elements(params);
    if (elements > kMaxElements)
        throw StageError(DEFREC_ERROR_UNSUPPORTED, std::string(stage) + ": a disparity image of " +
                                                       std::to_string(elements) +
                                                       " elements, this device takes at most " +
                                                       std::to_string(kMaxElements));
}

}  // namespace defrec::cpu
