// Both sides of a registration: points of the surface that a camera sees, and the model's surface.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/registration/model_surface.hpp"
#include "sdk/registration/pose.hpp"

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

    // The camera in the frame that is seen: it did not see what is turned away from it.
    std::optional<Eigen::Vector3d> viewer = Eigen::Vector3d::Zero();
    double point_error_mm;  // of points without a covariance
    double model_error_mm;  // standard deviation by which the model's surface is off
    // Verdict.
    double max_residual_mm;   // robust standard deviation of the residuals
    double min_inlier_share;  // of the points
    double max_error_mm;      // of a direction, root mean square over the points

    SurfaceOptions();  // defaults of defrec_registration_desc
};

// A point of the surface that was seen.
struct SeenPoint {
    Eigen::Vector3d place;       // mm
    Eigen::Matrix3d covariance;  // mm^2
    Eigen::Vector3d normal;      // towards the camera, unit length; 0: not known
};

// The data that all fits of a registration share.
struct SurfaceProblem {
    // Throws Error(DEFREC_ERROR_ARGUMENT) as register_surface() does. The model outlives it.
    SurfaceProblem(const ModelSurface& its_model, const SeenSurface& seen,
                   const SurfaceOptions& options);

    const ModelSurface& model;
    std::vector<SeenPoint> points;
    std::optional<Eigen::Vector3d> viewer;  // the camera, where the points were seen from there
    double model_error_mm;                  // standard deviation of the model's own surface
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of the points
    double length = 1;                                 // mm, typical distance from it

    // Every so many points are compared, where most of them do.
    size_t step_for(size_t most) const { return (points.size() + most - 1) / most; }
};

}  // namespace defrec
