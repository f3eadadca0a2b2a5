// One camera's lens: normalised directions to pixels and back, with OpenCV's distortion model of up
// to 14 coefficients (https://docs.opencv.org/4.6.0/d9/d0c/group__calib3d.html).
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "include/defrec_c.h"

namespace defrec {

class Lens {
  public:
    // Finite intrinsics, fx and fy > 0, of images of width x height px.
    Lens(const defrec_intrinsics& intrinsics, uint32_t width, uint32_t height);

    bool distorted() const { return distorted_; }
    // Radius of the directions (x, y, 1) up to which no two of them share a pixel.
    double limit() const { return std::sqrt(limit2_); }

    // The pixel of a direction (x, y, 1). false beyond the limit, where the distortion folds.
    bool project(const Eigen::Vector2d& direction, Eigen::Vector2d& pixel) const;
    // The direction (x, y, 1) of a pixel. false where none is found.
    bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector2d& direction) const;

  private:
    double radial(double r2) const;
    Eigen::Vector2d distort(const Eigen::Vector2d& direction) const;
    Eigen::Vector2d distort_flat(const Eigen::Vector2d& direction) const;
    bool undistort(const Eigen::Vector2d& distorted, Eigen::Vector2d& direction) const;
    bool folds(double radius) const;
    void find_limit(double reach);

    defrec_intrinsics intrinsics_;
    Eigen::Matrix3d tilt_, untilt_;
    double limit2_ = 0;  // square of the limit
    bool distorted_ = false;
};

}  // namespace defrec
