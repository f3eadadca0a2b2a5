// The files that `defrec register` reads besides the model.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace defrec::cli {

// Every failure of a reader is a CliError(kInput) that names file and line.

struct SurfaceFile {
    std::vector<float> places, normals,
        covariances;           // as of defrec_registration_desc; the last two may be empty
    std::size_t left_out = 0;  // vertices that were not observed
    std::string error_column;  // where the covariances come from; empty: there are none
};
// PLY or CSV with x, y, z; nx, ny, nz; the covariance xx, xy, xz, yy, yz, zz, or expected_error_mm,
// whose error is taken to lie along the line of sight from the origin; and status, of which only
// observed ones are taken, as `defrec track --meshes` and points.csv have it.
SurfaceFile read_surface_file(const std::filesystem::path& path);

// Columns id, model_x, model_y, model_z, x, y, z, and either error_mm and model_error_mm or none.
struct PairsFile {
    std::vector<std::int64_t> ids;
    // As of defrec_registration_pairs.
    std::vector<double> model_xyz, seen_xyz, model_covariance, seen_covariance;

    // is_one: of each, 1 or 0.
    PairsFile those(const std::vector<std::uint8_t>& is_one) const;
};
PairsFile read_pairs_file(const std::filesystem::path& path);

struct ModelTarget {
    std::string name;
    std::array<double, 3> place;  // mm, in the model's frame
};
// Columns id, x, y, z.
std::vector<ModelTarget> read_model_targets(const std::filesystem::path& path);

struct PoseFile {
    std::array<double, 12> pose{};  // 3x4 row-major
    std::string verdict;            // of a registration.json; or empty
};
// Columns x, y, z, t: the three rows of [R | t], mm; or the transform of a registration.json.
PoseFile read_pose_file(const std::filesystem::path& path);

}  // namespace defrec::cli
