// See lens.hpp.
#include "sdk/rig/lens.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

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

// The largest distance from the principal point to a corner of the image, in units of the focal
// length.
double image_reach(const defrec_intrinsics& camera, uint32_t width, uint32_t height) {
    const double x = std::max(std::abs(camera.cx), std::abs(width - 1.0 - camera.cx)) / camera.fx;
    const double y = std::max(std::abs(camera.cy), std::abs(height - 1.0 - camera.cy)) / camera.fy;
    return std::hypot(x, y);
}

// Columns: how the result changes with each coordinate.
template <class Function>
Eigen::Matrix2d jacobian_of(const Function& function, const Eigen::Vector2d& at) {
    constexpr double kDifference = 1e-6;
    Eigen::Matrix2d jacobian;
    for (int i = 0; i < 2; ++i) {
        const Eigen::Vector2d offset = kDifference * Eigen::Vector2d::Unit(i);
        jacobian.col(i) = (function(at + offset) - function(at - offset)) / (2 * kDifference);
    }
    return jacobian;
}

}  // namespace

Lens::Lens(const defrec_intrinsics& intrinsics, uint32_t width, uint32_t height)
    : intrinsics_(intrinsics) {
    const double* d = intrinsics_.distortion;
    for (uint32_t i = 0; i < intrinsics_.distortion_count; ++i)
        distorted_ = distorted_ || d[i] != 0;
    std::fill(intrinsics_.distortion + intrinsics_.distortion_count, intrinsics_.distortion + 14,
              0.0);
    tilt_ = tilt_matrix(d[TX], d[TY]);
    untilt_ = tilt_.inverse();
    find_limit(image_reach(intrinsics_, width, height));
}

double Lens::radial(double r2) const {
    const double* d = intrinsics_.distortion;
    return (1 + r2 * (d[K1] + r2 * (d[K2] + r2 * d[K3]))) /
           (1 + r2 * (d[K4] + r2 * (d[K5] + r2 * d[K6])));
}

// Whether the distortion turns the plane over somewhere at this radius.
bool Lens::folds(double radius) const {
    constexpr int kDirections = 64;
    for (int i = 0; i < kDirections; ++i) {
        const double angle = 2 * std::numbers::pi * i / kDirections;
        const Eigen::Vector2d at(radius * std::cos(angle), radius * std::sin(angle));
        const auto flat = [&](const Eigen::Vector2d& p) { return distort_flat(p); };
        if (!(jacobian_of(flat, at).determinant() > 0)) return true;
    }
    return false;
}

// Walks outwards in small steps while the distorted radius grows, to a good deal beyond reach; then
// again, in larger steps, where the distortion is not radial alone.
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
    const double* d = intrinsics_.distortion;
    const bool is_radial =
        d[P1] == 0 && d[P2] == 0 && d[S1] == 0 && d[S2] == 0 && d[S3] == 0 && d[S4] == 0;
    constexpr int kLargeSteps = 256;
    for (int i = 1; i < kLargeSteps && !is_radial; ++i) {
        double beyond = limit * i / kLargeSteps;
        if (!folds(beyond)) continue;
        double within = limit * (i - 1) / kLargeSteps;
        for (int halving = 0; halving < 16; ++halving) {
            const double middle = (within + beyond) / 2;
            (folds(middle) ? beyond : within) = middle;
        }
        limit = within;
        break;
    }
    limit2_ = limit * limit;
}

// On a sensor that is not tilted.
Eigen::Vector2d Lens::distort_flat(const Eigen::Vector2d& direction) const {
    const double* d = intrinsics_.distortion;
    const double x = direction.x(), y = direction.y(), r2 = direction.squaredNorm(), r4 = r2 * r2;
    const double scale = radial(r2);
    return {x * scale + 2 * d[P1] * x * y + d[P2] * (r2 + 2 * x * x) + d[S1] * r2 + d[S2] * r4,
            y * scale + d[P1] * (r2 + 2 * y * y) + 2 * d[P2] * x * y + d[S3] * r2 + d[S4] * r4};
}

Eigen::Vector2d Lens::distort(const Eigen::Vector2d& direction) const {
    return (tilt_ * distort_flat(direction).homogeneous()).hnormalized();
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
    constexpr double kAccuracy = 1e-12, kAccepted = 1e-9;
    const auto distorted_at = [&](const Eigen::Vector2d& p) { return distort(p); };
    Eigen::Vector2d at = (untilt_ * distorted.homogeneous()).hnormalized();
    Eigen::Vector2d residual = distort(at) - distorted;
    for (int iteration = 0; iteration < 50 && residual.norm() > kAccuracy; ++iteration) {
        const Eigen::Vector2d step = jacobian_of(distorted_at, at).inverse() * residual;
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
