// Whether targets are places of the model that is registered, as their places tell.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "sdk/io/mesh_file.hpp"
#include "sdk/registration/program/inputs.hpp"

namespace defrec::cli {

struct GivenTargets {
    std::span<const ModelTarget> targets;
    const MeshFile* model = nullptr;   // mm; null: there is none
    const PairsFile* pairs = nullptr;  // likewise
    std::array<double, 12> transform;  // that was found, 3x4 row-major
};
// What is said where most lie beside the model or in one point of it, with the likely cause; empty
// where nothing speaks against them.
std::string doubtful_targets(const GivenTargets& given);

// A note on targets that are registered, and lie behind the camera; empty: none do.
std::string targets_behind_camera(std::span<const ModelTarget> targets,
                                  std::span<const std::array<double, 3>> places);

}  // namespace defrec::cli
