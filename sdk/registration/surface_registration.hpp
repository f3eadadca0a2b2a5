// Registration of a model's surface to points of the surface that a camera sees, part of the organ.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/base/os/services.hpp"
#include "sdk/registration/model_surface.hpp"
#include "sdk/registration/registration.hpp"

namespace defrec {

// Points of a surface, as defrec_result has them. normals and covariances may be empty.
struct SeenSurface {
    std::span<const float> places;       // xyz each, mm
    std::span<const float> normals;      // xyz each, towards the camera; 0 0 0: not known
    std::span<const float> covariances;  // xx, xy, xz, yy, yz, zz each, mm^2
};

struct SurfaceOptions {
    // The first start, from the model's frame to the frame that is seen, and how far from the true
    // pose it may be: a turn about the middle of the points, and a shift. Other starts lie within.
    Pose start;
    double start_turn;      // rad
    double start_shift_mm;  // mm
    uint32_t starts;        // all together

    // Where the camera stands in the frame that is seen: what is turned away from it was not seen.
    std::optional<Eigen::Vector3d> viewer = Eigen::Vector3d::Zero();
    double point_error_mm;  // of points without a covariance
    double model_error_mm;  // standard deviation by which the model's surface is off
    // Verdict.
    double max_residual_mm;   // robust standard deviation of the residuals
    double min_inlier_share;  // of the points
    double max_error_mm;      // of a direction, root mean square over the points

    SurfaceOptions();  // defaults of defrec_registration_desc
};

// helpers: whose threads take part; null: the caller's alone. The result does not depend on them.
// Throws Error(DEFREC_ERROR_ARGUMENT) for arrays of unlike lengths, numbers that are not finite,
// covariances that are none and for too few points; std::bad_alloc. Options are within the ranges
// of defrec_registration_desc.
Registration register_surface(const ModelSurface& model, const SeenSurface& seen,
                              const SurfaceOptions& options, const Services* helpers);

}  // namespace defrec
