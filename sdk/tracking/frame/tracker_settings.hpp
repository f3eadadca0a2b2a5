// The settings that a tracker is given, and the numbers by which it decides.
#pragma once
#include "include/defrec_c.h"
#include "sdk/tracking/decisions/settings.hpp"

namespace defrec {

class Rig;

// A tracker's description with every default filled in, and the numbers that are no option.
struct TrackerSettings : defrec_tracker_desc, decisions::Reasons {};
// With the defaults that do not depend on the rig.
TrackerSettings with_defaults(const defrec_tracker_desc& desc);
// Throws Error(DEFREC_ERROR_ARGUMENT) for values that are out of range.
TrackerSettings complete_settings(const defrec_tracker_desc& desc, const Rig& rig);

// Between control points, px; width: of the template's image.
constexpr float default_node_spacing(uint32_t width) {
    return static_cast<float>(width) / decisions::Grids::kNodesAcross;
}

}  // namespace defrec
