// The scenes that a stereo microscope sees. docs/program/reference_sequences.md describes them.
#pragma once

#include "sdk/scenes/scene_setting.hpp"

namespace defrec::cli {

FrameState microscope(const Setting& setting, double time);
// Tissue and light as the microscope's field has them.
void magnify(const SceneParameters& parameters, Scene& scene);

StereoRig microscope_rig(const SceneParameters& parameters, int width, int height);
StereoRig toe_in_rig(const SceneParameters& parameters, int width, int height);

}  // namespace defrec::cli
