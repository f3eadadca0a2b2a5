// What a registration leaves open: the covariance of a pose, the directions in which nothing holds
// it, and the errors of targets that follow.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "sdk/registration/pose.hpp"

namespace defrec {

// A motion of the model that the data do not tell from rest.
struct FreeMotion {
    // A turn about an axis, through a point, with a shift along the axis; or a shift alone.
    bool is_turn = false;
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // unit length, in the frame that is seen
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  // mm, on the axis of a turn
    double pitch_mm = 0;                              // shift along the axis for each rad
    double expected_mm = 0;  // standard deviation, at the typical distance of the data

    // "turn about the axis (0 0 1) through (0 0 60) mm", "shift along (1 0 0)".
    std::string text() const;
};

// The normal equations of a pose about a centre, in which a turn is measured by the shift that it
// gives at a typical distance from there: all six numbers are mm.
struct PoseInformation {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // mm, in the frame that is seen
    double length = 1;                                 // mm, that distance
    TwistMatrix matrix = TwistMatrix::Zero();          // 1 / mm^2, for independent data
    double variance_scale = 1;  // what the covariance is to be multiplied by: the residuals say so

    // Rows of the Jacobian are gradients by turn * length, then shift.
    void add(const Twist& gradient, double weight);
};

struct PoseUncertainty {
    // Covariance of a twist about the frame's origin (place_shift): rad^2, rad mm, mm^2. Free
    // motions have a variance of kFree^2 in it, so that no target looks safe.
    TwistMatrix covariance = TwistMatrix::Zero();
    std::vector<FreeMotion> free;
    double worst_mm = 0;  // the largest standard deviation of a direction that is none of these
};

// min_share: a direction is free whose information is less than that share of `whole`, what moving
// all data directly towards or away from the surface would have; max_error_mm: or whose standard
// deviation is larger.
PoseUncertainty uncertainty_of(const PoseInformation& information, double whole, double min_share,
                               double max_error_mm);

// From mm about a centre, as of PoseInformation, to rad and mm about the frame's origin.
TwistMatrix twist_to_origin(const Eigen::Vector3d& centre, double length);

// Covariance of the error of a place in the frame that is seen, mm^2.
inline Eigen::Matrix3d target_covariance(const TwistMatrix& covariance,
                                         const Eigen::Vector3d& place) {
    const Eigen::Matrix<double, 3, 6> shift = place_shift(place);
    return shift * covariance * shift.transpose();
}

}  // namespace defrec
