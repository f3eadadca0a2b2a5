// The rigid motion of what lies deep beneath a surface that deforms. A part of the surface is moved
// by forces, of an instrument, say; the rest is moved by the tissue beneath it alone. So that
// motion is the true one under which the fewest handles need a force. (A least-squares fit of the
// surface goes along with its mean deformation.)
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

namespace defrec {

// Best rigid motion from one set of points to another, a column each (Kabsch). Points in a row turn
// with it, and not about it.
Eigen::Isometry3d fit_rigid(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                            const Eigen::VectorXd& weight);
// The same of those that move alike. floor_mm: what is no deformation yet.
Eigen::Isometry3d fit_rigid_robust(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                   const Eigen::VectorXd& weight, double floor_mm);

// A small rigid motion: translation, then rotation vector.
using SmallMotion = Eigen::Matrix<double, 6, 1>;
Eigen::Isometry3d as_motion(const SmallMotion& small);
// How such a motion displaces points, three columns each.
using MotionSlope = Eigen::Matrix<double, Eigen::Dynamic, 6>;
MotionSlope motion_slope(const Eigen::Matrix3Xd& points);

// Residuals, three rows for each handle, and how a motion lessens them: values - slope * motion.
struct HandleResiduals {
    Eigen::VectorXd values;
    MotionSlope slope;
    double floor = 0;  // what may be noise
    double share = 1;  // of what they say that counts
};
// What is known of a motion beforehand.
struct MotionPrior {
    SmallMotion motion = SmallMotion::Zero();
    Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
};
// What a camera's pose tells: from the present estimate to the expected motion; the tissue's own is
// a small one about the centre.
MotionPrior camera_prior(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& expected,
                         const Eigen::Vector3d& centre);
// The motion that leaves the fewest handles residuals, of either kind.
SmallMotion sparsest(std::span<const HandleResiduals> kinds, const Eigen::VectorXd& weight,
                     const MotionPrior& prior);
// The size of residuals that half of the weight does not exceed.
double median_size(const Eigen::VectorXd& values, const Eigen::VectorXd& weight);

}  // namespace defrec
