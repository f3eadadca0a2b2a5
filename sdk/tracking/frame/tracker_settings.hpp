// A tracker's description with every default filled in.
#pragma once
#include "include/defrec_c.h"
#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {

class Rig;

using TrackerSettings = defrec_tracker_desc;
// Throws Error(DEFREC_ERROR_ARGUMENT) for values that are out of range.
TrackerSettings complete_settings(const defrec_tracker_desc& desc, const Rig& rig);

// Between control points, px; width: of the template's image.
constexpr float default_node_spacing(uint32_t width) {
    return static_cast<float>(width) / decisions::Grids::kNodesAcross;
}

}  // namespace defrec
