// model.ply and targets.csv: where a model lies in the frame that is seen, deformed where it was.
#pragma once

#include <filesystem>
#include <vector>

#include "sdk/io/mesh_file.hpp"
#include "sdk/registration/program/register_json.hpp"

namespace defrec::cli {

struct PlacedModel {
    std::vector<double> xyz;                // of each vertex, mm
    std::vector<double> expected_error_mm;  // of each
};
PlacedModel placed_model(const RegisterFindings& findings, const MeshFile& model);

// Throw FileError.
void write_model(const std::filesystem::path& path, const PlacedModel& placed,
                 const MeshFile& model);
// Columns name, x, y, z, expected_error_mm.
void write_targets(const std::filesystem::path& path, const RegisterFindings& findings);

}  // namespace defrec::cli
