// The scenes whose tissue is an elastic body, with targets beneath its surface.
// docs/program/reference_sequences.md describes them.
#pragma once

#include <vector>

#include "sdk/scenes/scene_setting.hpp"

namespace defrec::cli {

FrameState body_indent(const Setting& setting, double time);
FrameState body_pull(const Setting& setting, double time);
FrameState body_stroke(const Setting& setting, double time);
FrameState body_rigid(const Setting& setting, double time);
FrameState body_lift(const Setting& setting, double time);
FrameState body_press(const Setting& setting, double time);

Body half_space(const SceneParameters& parameters);
Body bonded_layer(const SceneParameters& parameters);
Body rigid_body(const SceneParameters& parameters);
// Recorded ones.
Body organ_body(const SceneParameters& parameters);
Body retracted_body(const SceneParameters& parameters);
Body block_with_inclusion(const SceneParameters& parameters);

/// Those that every scene with a body has, after its own.
std::vector<SceneParameter> with_body_parameters(std::vector<SceneParameter> own);
SceneParameter poisson_parameter();
SceneParameter recorded_poisson_parameter();
SceneParameter relief_parameter();
SceneParameter tool_parameter(bool is_drawn);
SceneParameter turn_parameter();

}  // namespace defrec::cli
