// Sheets of tissue: the parts of a scene whose tissue is not one surface over the picture's plane,
// such as flaps, organs in contact, folds and loops. What lasts all the sequence; a frame has the
// formula of each sheet.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "sdk/scenes/mesh_raster.hpp"
#include "sdk/scenes/tissue.hpp"

namespace defrec::cli {

// mm of material: more than any scene's camera sees.
inline constexpr double kTissueHalfWidth = 96.0;
inline constexpr double kTissueHalfHeight = 78.0;
inline constexpr double kTissueSpacing = 0.6;  ///< mm between vertices

/// What sheets of one kind of tissue look like; defined for |s| <= half_width, |t| <= half_height.
struct Texture {
    TissueLook look;
    double half_width = kTissueHalfWidth, half_height = kTissueHalfHeight;  ///< mm
    std::uint64_t seed = 0;
};

struct Sheet {
    Lattice lattice;          ///< of its mesh
    std::size_t texture = 0;  ///< of Scene::textures
    LatticeWindow hole{};     ///< cells between these vertices are left to another sheet
    /// Whether points there are followed; empty: none are.
    std::function<bool(const Eigen::Vector2d& material)> has_points{};
};

/// All of the tissue, with points everywhere.
inline Sheet whole_sheet(std::size_t texture, double spacing_s = kTissueSpacing) {
    return {
        .lattice = centred_lattice(kTissueHalfWidth, kTissueHalfHeight, spacing_s, kTissueSpacing),
        .texture = texture,
        .has_points = [](const Eigen::Vector2d& /*material*/) { return true; }};
}

}  // namespace defrec::cli
