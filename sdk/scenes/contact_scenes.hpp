// The scenes in which tissue is touched hard or cut, or lies in lobes.
// docs/program/reference_sequences.md describes them.
#pragma once

#include "sdk/scenes/scene_setting.hpp"

namespace defrec::cli {

FrameState pinch(const Setting& setting, double frame);
FrameState grasp(const Setting& setting, double frame);
FrameState two_instruments(const Setting& setting, double frame);
FrameState cut(const Setting& setting, double frame);
FrameState lobes(const Setting& setting, double frame);

/// Gives a cut its floor, lobes the wall between them.
void deepen(const SceneParameters& parameters, Scene& scene);

}  // namespace defrec::cli
