// Registration of a model's surface to points of the surface that a camera sees, part of the organ.
#pragma once
#include "sdk/base/os/services.hpp"
#include "sdk/registration/model_surface.hpp"
#include "sdk/registration/registration.hpp"
#include "sdk/registration/surface_problem.hpp"

namespace defrec {

// helpers: whose threads take part; null: the caller's alone. The result does not depend on them.
// Throws Error(DEFREC_ERROR_ARGUMENT) for arrays of unlike lengths, numbers that are not finite,
// covariances that are none and for too few points; std::bad_alloc. Options are within the ranges
// of defrec_registration_desc.
Registration register_surface(const ModelSurface& model, const SeenSurface& seen,
                              const SurfaceOptions& options, const Services* helpers);

}  // namespace defrec
