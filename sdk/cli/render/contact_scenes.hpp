// The scenes in which instruments touch the tissue hard. docs/reference_sequences.md describes
// them.
#pragma once

#include "sdk/cli/render/scene_setting.hpp"

namespace defrec::cli {

FrameState pinch(const Setting& setting, double frame);
FrameState grasp(const Setting& setting, double frame);
FrameState two_instruments(const Setting& setting, double frame);

}  // namespace defrec::cli
