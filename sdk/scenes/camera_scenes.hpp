// The scenes in which the camera moves far. docs/program/reference_sequences.md describes them.
#pragma once

#include "sdk/scenes/scene_setting.hpp"

namespace defrec::cli {

FrameState approach(const Setting& setting, double frame);
FrameState roll(const Setting& setting, double frame);
FrameState slide(const Setting& setting, double frame);

}  // namespace defrec::cli
