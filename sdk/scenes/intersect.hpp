// Where a ray meets a surface that is given by a formula.
#pragma once

#include <Eigen/Core>

#include "sdk/scenes/mesh_raster.hpp"

namespace defrec::cli {

/// Material coordinates where the ray origin + z * direction meets the surface, within 1e-7 mm, by
/// Newton's method from a guess within a few mm. Returns false where the iteration does not
/// converge.
bool intersect(const MeshFormula& at, const Eigen::Vector3d& origin,
               const Eigen::Vector3d& direction, Eigen::Vector2d& material);

/// Towards the side from which s runs to the right and t runs down: of the surface in a plane, the
/// camera's. Not normalised.
Eigen::Vector3d normal_of(const MeshFormula& at, const Eigen::Vector2d& material);

}  // namespace defrec::cli
