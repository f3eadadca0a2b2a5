// Points that were seen, each with the nearest place of a model's surface: how they fit, and what
// each counts.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sdk/registration/pose.hpp"
#include "sdk/registration/surface_problem.hpp"
#include "sdk/registration/triangle_tree.hpp"
#include "sdk/registration/uncertainty.hpp"

namespace defrec {

// The nearest point of the model to a seen point.
struct SurfaceMatch {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();   // where it is seen
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // outside, unit length
    double residual = 0;                               // mm, of the seen point along the normal
    double expected = 1;                               // mm, standard deviation that its errors
                                                       // explain
    bool is_valid = false;                             // the normals agree
};

// How the points of one pose fit.
struct SurfaceFitQuality {
    double scale = 1;         // robust standard deviation of residual / expected
    double robust_mm = 0;     // of the residuals
    double rms_mm = 0;        // of the inliers
    double inlier_share = 0;  // of all points
    double cost = 0;          // mean of Tukey's function in units of `scale`, 0..1
};

// Every step-th point of a problem and its nearest place.
struct SurfaceMatches {
    static constexpr uint32_t kNoTriangle = std::numeric_limits<uint32_t>::max();

    SurfaceMatches(const SurfaceProblem& its_problem, size_t its_step);

    // Finds the nearest places. tree: of the model's triangles, in the shape that they have.
    void find(const TriangleTree& tree, const Pose& pose);

    double robust_scale() const;
    // As the last match has it; scale: in which outliers are told, 0: the fit's own.
    SurfaceFitQuality quality(double scale = 0) const;
    // Weight of each match: 1 for a point that fits, 0 for an outlier.
    std::vector<double> weights(double scale) const;
    // The normal equations of the pose, and what they would be if all points moved along their
    // normals. parameters: how many numbers were fitted.
    PoseInformation information(double scale, double parameters, double& whole) const;
    // How a match's residual falls with a turn, times the problem's length, about its centre, and
    // a shift.
    Twist gradient(const SurfaceMatch& match) const;

    const SurfaceProblem* problem;
    size_t step;
    std::vector<SurfaceMatch> all;
    std::vector<uint32_t> triangle;  // the nearest, of each; kNoTriangle: none was found yet
};

// Tukey's biweight (Beaton and Tukey, Technometrics 16, 1974) for a residual in standard
// deviations.
double tukey_weight(double ratio);

}  // namespace defrec
