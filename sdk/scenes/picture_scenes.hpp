// The scenes that are hard because of the picture or the rig. docs/program/reference_sequences.md
// describes them.
#pragma once

#include "sdk/scenes/scene_setting.hpp"

namespace defrec::cli {

FrameState late_view(const Setting& setting, double time);
FrameState misaligned(const Setting& setting, double time);
FrameState sideways(const Setting& setting, double time);
FrameState blood(const Setting& setting, double time);
FrameState heavy_smoke(const Setting& setting, double time);
FrameState compressed(const Setting& setting, double time);
FrameState motion_blur(const Setting& setting, double time);
FrameState headlight(const Setting& setting, double time);
FrameState defocus(const Setting& setting, double time);
FrameState sheen(const Setting& setting, double time);
FrameState fat(const Setting& setting, double time);

// What lasts all the sequence.
void compress(const SceneParameters& parameters, Scene& scene);
void polish(const SceneParameters& parameters, Scene& scene);
void pale(const SceneParameters& parameters, Scene& scene);

}  // namespace defrec::cli
