// Where a ray meets a surface that is given by a formula.
#include "sdk/scenes/intersect.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace defrec::cli {
namespace {

constexpr double kStep = 1e-4;  // mm, of difference quotients

/// The derivatives by s and by t.
void differentiate(const MeshFormula& at, double s, double t, Eigen::Matrix3d& jacobian) {
    jacobian.col(0) = (at(s + kStep, t) - at(s - kStep, t)) / (2.0 * kStep);
    jacobian.col(1) = (at(s, t + kStep) - at(s, t - kStep)) / (2.0 * kStep);
}

}  // namespace

bool intersect(const MeshFormula& at, const Eigen::Vector3d& origin,
               const Eigen::Vector3d& direction, Eigen::Vector2d& material) {
    double s = material.x(), t = material.y();
    double z = (at(s, t) - origin).dot(direction) / direction.squaredNorm();
    for (int i = 0; i < 50; ++i) {
        const Eigen::Vector3d point = at(s, t);
        Eigen::Matrix3d jacobian;
        differentiate(at, s, t, jacobian);
        jacobian.col(2) = -direction;
        const Eigen::Vector3d error = point - origin - z * direction;
        if (error.norm() < 1e-8) {
            material = {s, t};
            return true;
        }
        const Eigen::Vector3d step = jacobian.partialPivLu().solve(error);
        s -= step.x();
        t -= step.y();
        z -= step.z();
    }
    return false;
}

Eigen::Vector3d normal_of(const MeshFormula& at, const Eigen::Vector2d& material) {
    Eigen::Matrix3d jacobian;
    differentiate(at, material.x(), material.y(), jacobian);
    return jacobian.col(1).cross(jacobian.col(0));
}

}  // namespace defrec::cli
