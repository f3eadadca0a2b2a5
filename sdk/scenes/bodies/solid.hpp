// Closed triangle meshes of a body's parts, in material coordinates (s, t, depth) in mm.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace defrec::cli {

struct Box {
    Eigen::Vector3d low, high;
};

struct Ball {
    Eigen::Vector3d centre;
    double radius;  ///< mm
};

/// Triangles turn counter-clockwise, seen from outside.
struct SolidMesh {
    std::vector<Eigen::Vector3d> points;
    std::vector<std::array<std::int32_t, 3>> triangles;
};

/// step: mm between its points, at most.
SolidMesh mesh_of(const Box& box, double step);
SolidMesh mesh_of(const Ball& ball, double step);

/// Binary little-endian PLY with float coordinates.
std::string ply_of(const SolidMesh& mesh);

}  // namespace defrec::cli
