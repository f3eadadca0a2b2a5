// See lens.hpp.
#include "sdk/rig/lens.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace defrec {
namespace {

enum { K1, K2, P1, P2, K3, K4, K5, K6, S1, S2, S3, S4, TX, TY };

// Projects points of the ideal image plane along the rays onto a sensor plane tilted by (tx, ty).
Eigen::Matrix3d tilt_matrix(double tx, double ty) {
    const double cx = std::cos(tx), sx = std::sin(tx), cy = std::cos(ty), sy = std::sin(ty);
    Eigen::Matrix3d rotation, projection;
    rotation << cy, sy * sx, -sy * cx, 0, cx, sx, sy, -cy * sx, cy * cx;
    projection << rotation(2, 2), 0, -rotation(0, 2), 0, rotation(2, 2), -rotation(1, 2), 0, 0, 1;
    return projection * rotation;
}

}  // namespace

Lens::Lens(const defrec_intrinsics& intrinsics, double reach) : intrinsics_(intrinsics) {
    const double* d = intrinsics_.distortion;
    for (uint32_t i = 0; i < intrinsics_.distortion_count; ++i)
        distorted_ = distorted_ || d[i] != 0;
    std::fill(intrinsics_.distortion + intrinsics_.distortion_count, intrinsics_.distortion + 14,
              0.0);
    tilt_ = tilt_matrix(d[TX], d[TY]);
    untilt_ = tilt_.inverse();
    find_limit(reach);
}

double Lens::radial(double r2) const {
    const double* d = intrinsics_.distortion;
    return (1 + r2 * (d[K1] + r2 * (d[K2] + r2 * d[K3]))) /
           (1 + r2 * (d[K4] + r2 * (d[K5] + r2 * d[K6])));
}

// Walks outwards in small steps while the distorted radius grows, to a good deal beyond reach.
void Lens::find_limit(double reach) {
    constexpr int kSteps = 4096;
    const double end = 4 * reach, step = end / kSteps;
    double before = 0, limit = end;
    for (int i = 1; i <= kSteps; ++i) {
        const double r = i * step, after = r * radial(r * r);
        if (!(after > before)) {
            limit = r - step;
            break;
        }
        before = after;
    }
    limit2_ = limit * limit;
    monotone_ = before >= reach;
}

Eigen::Vector2d Lens::distort(const Eigen::Vector2d& direction) const {
    const double* d = intrinsics_.distortion;
    const double x = direction.x(), y = direction.y(), r2 = direction.squaredNorm(), r4 = r2 * r2;
    const double scale = radial(r2);
    const Eigen::Vector3d flat(
        x * scale + 2 * d[P1] * x * y + d[P2] * (r2 + 2 * x * x) + d[S1] * r2 + d[S2] * r4,
        y * scale + d[P1] * (r2 + 2 * y * y) + 2 * d[P2] * x * y + d[S3] * r2 + d[S4] * r4, 1);
    return (tilt_ * flat).hnormalized();
}

bool Lens::project(const Eigen::Vector2d& direction, Eigen::Vector2d& pixel) const {
    if (distorted_ && direction.squaredNorm() > limit2_) return false;
    const Eigen::Vector2d image = distorted_ ? distort(direction) : direction;
    pixel = {intrinsics_.fx * image.x() + intrinsics_.cx,
             intrinsics_.fy * image.y() + intrinsics_.cy};
    return true;
}

bool Lens::unproject(const Eigen::Vector2d& pixel, Eigen::Vector2d& direction) const {
    const Eigen::Vector2d image((pixel.x() - intrinsics_.cx) / intrinsics_.fx,
                                (pixel.y() - intrinsics_.cy) / intrinsics_.fy);
    if (distorted_) return undistort(image, direction);
    direction = image;
    return image.allFinite();
}

// Newton's method with the step halved until the residual shrinks.
bool Lens::undistort(const Eigen::Vector2d& distorted, Eigen::Vector2d& direction) const {
    constexpr double kDifference = 1e-6, kAccuracy = 1e-12, kAccepted = 1e-9;
    Eigen::Vector2d at = (untilt_ * distorted.homogeneous()).hnormalized();
    Eigen::Vector2d residual = distort(at) - distorted;
    for (int iteration = 0; iteration < 50 && residual.norm() > kAccuracy; ++iteration) {
        Eigen::Matrix2d jacobian;
        for (int i = 0; i < 2; ++i) {
            const Eigen::Vector2d offset = kDifference * Eigen::Vector2d::Unit(i);
            jacobian.col(i) = (distort(at + offset) - distort(at - offset)) / (2 * kDifference);
        }
        const Eigen::Vector2d step = jacobian.inverse() * residual;
        double share = 1;
        Eigen::Vector2d next = at - step, next_residual = distort(next) - distorted;
        while (!(next_residual.norm() < residual.norm()) && share > 1e-4) {
            share /= 2;
            next = at - share * step;
            next_residual = distort(next) - distorted;
        }
        if (!(next_residual.norm() < residual.norm())) break;
        at = next;
        residual = next_residual;
    }
    direction = at;
    return residual.norm() <= kAccepted && at.squaredNorm() <= limit2_;
}

}  // namespace defrec
