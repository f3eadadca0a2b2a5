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

// Best rigid motion from one set of points to another, three columns each (Kabsch).
Eigen::Isometry3d fit_rigid(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                            const Eigen::VectorXd& weight);
// The same of those that move alike. floor_mm: what is no deformation yet.
Eigen::Isometry3d fit_rigid_robust(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                   const Eigen::VectorXd& weight, double floor_mm);

// The small rigid motion, translation and then rotation vector, that makes residuals, three rows
// for each handle, sparse: residuals - slope * motion.
Eigen::Matrix<double, 6, 1> sparsest(const Eigen::VectorXd& residuals,
                                     const Eigen::Matrix<double, Eigen::Dynamic, 6>& slope,
                                     const Eigen::VectorXd& weight, double floor);
Eigen::Isometry3d small_motion(const Eigen::Matrix<double, 6, 1>& motion);

}  // namespace defrec
