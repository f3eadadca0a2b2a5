// One camera's lens: normalised directions to pixels and back, with OpenCV's distortion model of up
// to 14 coefficients (https://docs.opencv.org/4.6.0/d9/d0c/group__calib3d.html).
#pragma once
#include <Eigen/Core>

#include "include/defrec_c.h"

namespace defrec {

class Lens {
  public:
    // Finite intrinsics, fx and fy > 0. reach: the largest radius in the normalised distorted plane
    // that matters.
    Lens(const defrec_intrinsics& intrinsics, double reach);

    // Whether the radial distortion grows with the radius up to reach.
    bool monotone() const { return monotone_; }
    bool distorted() const { return distorted_; }

    // The pixel of a direction (x, y, 1). false beyond the radius where the distortion stops to
    // grow.
    bool project(const Eigen::Vector2d& direction, Eigen::Vector2d& pixel) const;
    // The direction (x, y, 1) of a pixel. false where none is found.
    bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector2d& direction) const;

  private:
    double radial(double r2) const;
    Eigen::Vector2d distort(const Eigen::Vector2d& direction) const;
    bool undistort(const Eigen::Vector2d& distorted, Eigen::Vector2d& direction) const;
    void find_limit(double reach);

    defrec_intrinsics intrinsics_;
    Eigen::Matrix3d tilt_, untilt_;
    double limit2_ = 0;  // squared radius of directions up to which the distortion grows
    bool distorted_ = false;
    bool monotone_ = true;
};

}  // namespace defrec
