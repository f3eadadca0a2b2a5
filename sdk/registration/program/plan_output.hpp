// The plan that `defrec register --plan` writes.
#pragma once

#include <filesystem>
#include <span>

#include "sdk/client/library.hpp"
#include "sdk/io/mesh_file.hpp"
#include "sdk/registration/program/register_json.hpp"

namespace defrec::cli {

struct PlanInput {
    const Template& surface;
    const MeshFile* model;                 // mm, with its parts; null: targets alone
    std::filesystem::path model_path;      // a model without parts is one that has its name
    std::span<const ModelTarget> targets;  // in this order
    bool is_looked_at;
};

// False, with a note, where the verdict allows no plan. Throws CliError: kInput where model or
// targets make none, kOutput where the file cannot be written.
bool write_plan(const std::filesystem::path& path, const PlanInput& input,
                RegisterFindings& findings);

}  // namespace defrec::cli
