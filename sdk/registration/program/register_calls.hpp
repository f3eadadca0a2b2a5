// The library's registrations, by the options of `defrec register`.
#pragma once

#include <array>

#include "sdk/client/library.hpp"
#include "sdk/io/mesh_file.hpp"
#include "sdk/registration/program/inputs.hpp"
#include "sdk/registration/program/run_register.hpp"

namespace defrec::cli {

using Transform = std::array<double, 12>;  // 3x4 row-major

// A registration and what it says; the pointers of info live as long as the handle.
struct Registered {
    Registration handle;
    defrec_registration_info info{};

    bool is_accepted() const { return info.verdict == DEFREC_VERDICT_ACCEPTED; }
    Transform transform() const { return std::to_array(info.transform); }
};

// Inputs that the library refuses are a CliError(kInput) with their file.
Registered register_by_pairs(const PairsFile& pairs, const RegisterOptions& options);

// Surfaces that are compared. seen: null where a file has the surface.
struct SurfaceInput {
    const MeshFile& model;
    const SurfaceFile& surface;
    const Template& seen;
};
Registered register_by_surface(const Context& context, const SurfaceInput& input,
                               const Transform& start, const RegisterOptions& options);

}  // namespace defrec::cli
