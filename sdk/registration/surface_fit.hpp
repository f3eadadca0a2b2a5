// Draws a model's surface to points that were seen: point to plane, from one start.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/registration/model_surface.hpp"
#include "sdk/registration/pose.hpp"
#include "sdk/registration/uncertainty.hpp"

namespace defrec {

// A point of the surface that was seen.
struct SeenPoint {
    Eigen::Vector3d place;       // mm
    Eigen::Matrix3d covariance;  // mm^2
    Eigen::Vector3d normal;      // towards the camera, unit length; 0: not known
};

// The nearest point of the model to a seen point.
struct SurfaceMatch {
    Eigen::Vector3d place, normal;  // where it is seen; outside normal, unit length
    double residual = 0;            // mm, of the seen point along the normal
    double expected = 1;            // mm, standard deviation that its errors explain
    bool is_valid = false;          // the normals agree
};

// How the points of one pose fit.
struct SurfaceFitQuality {
    double scale = 1;         // robust standard deviation of residual / expected
    double robust_mm = 0;     // of the residuals
    double rms_mm = 0;        // of the inliers
    double inlier_share = 0;  // of all points
    double cost = 0;          // mean of Tukey's function in units of `scale`, 0..1
};

// What all fits of a registration share.
struct SurfaceProblem {
    const ModelSurface& model;
    std::vector<SeenPoint> points;
    std::optional<Eigen::Vector3d> viewer;  // the camera, where the points were seen from there
    double model_error_mm;                  // standard deviation of the model's own surface
    Eigen::Vector3d centre;                 // of the points
    double length;                          // mm, typical distance from it
};

class SurfaceFit {
  public:
    // The problem outlives the fit. step: every so many points are compared.
    SurfaceFit(const SurfaceProblem& problem, const Pose& start, size_t step);

    // Widely: every point pulls, those that are far away less and less.
    void approach();
    // Finely: least squares with Tukey's weights by the points' errors. Until it rests.
    void refine();

    const Pose& pose() const { return pose_; }
    // Mean of Geman and McClure's function of approach()'s last width, 0..1.
    double wide_cost() const;
    // As the last match has it; scale: in which outliers are told, 0: the fit's own.
    SurfaceFitQuality quality(double scale = 0) const;
    const std::vector<SurfaceMatch>& matches() const { return matches_; }
    // Weight of each match: 1 for a point that fits, 0 for an outlier.
    std::vector<double> weights(double scale) const;
    // The normal equations, and what they would be if all points moved along their normals.
    PoseInformation information(double scale, double& whole) const;

    // Finds the nearest points at a pose.
    void match();

  private:
    Twist gradient(const SurfaceMatch& match) const;
    // A step of least squares with these weights, divided by the squared errors where is_fine;
    // returns by how far it moves the points, mm.
    double move(const std::vector<double>& weights, double damping, bool is_fine);
    double robust_scale() const;

    const SurfaceProblem* problem_;
    size_t step_;
    Pose pose_;
    std::vector<SurfaceMatch> matches_;  // of every step_-th point
    std::vector<uint32_t> nearest_;      // triangles
};

}  // namespace defrec
