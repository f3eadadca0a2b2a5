// A tracker's description with every default filled in.
#pragma once
#include "include/defrec_c.h"

namespace defrec {

class Rig;

using TrackerSettings = defrec_tracker_desc;
// Throws Error(DEFREC_ERROR_ARGUMENT) for values that are out of range.
TrackerSettings complete_settings(const defrec_tracker_desc& desc, const Rig& rig);

}  // namespace defrec
