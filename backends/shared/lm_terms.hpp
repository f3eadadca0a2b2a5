// The terms of the cost that stage lm minimises, each for one residual: robust kernels, surface residuals with their Jacobians.
// Formulas on a scalar type T; docs/stages/lm.md derives them. The ARAP term is in lm_arap.hpp, the minimiser in levenberg_marquardt.hpp.
#pragma once
#include <algorithm>
#include <cmath>

#include "backends/shared/live_depth.hpp"

namespace defrec {

constexpr double kLeastFacing = 0.25;    // cosine between a surface and the direction to the camera below which ICP ignores it
constexpr double kMatchDepthWeight = 0.25;  // of a match's error in depth; 1 across the ray

// A residual's share of the cost, and the weight of its square in the linearised system.
template <class T>
struct Robust {
    T cost, weight;
};

// Tukey's kernel of a squared residual: weight (1 - x)^2 with x = squared / c^2, cost its integral. c > 0.
template <class T>
Robust<T> tukey(T squared, T inverse_c2) {
    const T x = std::min(squared * inverse_c2, T(1));
    const T rest = T(1) - x;
    return {(T(1) - rest * rest * rest) / (T(3) * inverse_c2), rest * rest};
}

// The paper's weight of matches that were not preselected, 1 - d / a up to d = a, times Tukey's; cost its integral.
template <class T>
Robust<T> ramped_tukey(T squared, T inverse_a, T inverse_c2) {
    const T distance = std::min(std::sqrt(squared), std::min(T(1) / inverse_a, T(1) / std::sqrt(inverse_c2)));
    const T d2 = distance * distance;
    const T x = d2 * inverse_c2;
    const T rest = T(1) - x;
    const T ramp = T(1) - distance * inverse_a;
    const T lost = T(2) * distance * inverse_a * (T(1) / T(3) - x * (T(2) / T(5)) + x * x / T(7));
    return {d2 * (T(1) - x + x * x / T(3) - lost), std::max(ramp, T(0)) * rest * rest};
}

// A residual along one direction: value is its size, gradient its derivative by the deformed point's position.
template <class T>
struct Row {
    Vec3<T> gradient;
    T value;
};

// Point to plane: how far the live surface lies from a deformed point, along the point's normal, mm. False where no live surface is
// associated with the point.
template <class T>
bool icp_row(const defrec_camera& camera, const DisparityImage& image, T association_mm, Vec3<T> position, Vec3<T> normal, Row<T>& row) {
    Pixel<T> pixel;
    if (!project_inside(camera, image, position, pixel)) return false;
    const T depth = live_depth(camera, image, pixel);
    if (!(depth > T(0))) return false;
    const T range = std::sqrt(dot(position, position)), slope = dot(normal, position);
    const T difference = (depth - position.z) / position.z;  // of the positions, in units of the point's own
    if (!(-slope >= T(kLeastFacing) * range) || !(std::abs(difference) * range <= association_mm)) return false;
    row = {T(-1) * normal, difference * slope};
    return true;
}

// A deformed landmark and the live feature it matches: two rows across the feature's ray and one in depth, mm. The last carries the square
// root of depth_weight, for stereo depth is less certain than direction.
template <class T>
void match_rows(Vec3<T> position, Vec3<T> live, T depth_weight, Row<T> rows[3]) {
    const Vec3<T> error = position - live;
    const T x = live.x / live.z, y = live.y / live.z, root = std::sqrt(depth_weight);
    rows[0] = {{T(1), T(0), -x}, error.x - x * error.z};
    rows[1] = {{T(0), T(1), -y}, error.y - y * error.z};
    rows[2] = {{T(0), T(0), root}, root * error.z};
}

// The information of a patch observation in its Cholesky factor, scaled down where it is more than 1 along some direction:
// |factor^T r|^2 = r^T information r.
template <class T>
struct PatchCertainty {
    T uu, uv, vv;  // lower triangle: [uu 0; uv vv]
};
// False where there is no information, or none that can be used.
template <class T>
bool patch_certainty(const float information[3], PatchCertainty<T>& factor) {
    const T a = T(information[0]), b = T(information[1]), c = T(information[2]);
    const T half = (a - c) / T(2);
    const T largest = (a + c) / T(2) + std::sqrt(half * half + b * b);
    if (!std::isfinite(largest) || !(largest > T(0)) || !(a >= T(0)) || !(c >= T(0))) return false;
    const T scale = T(1) / std::max(largest, T(1));
    factor.uu = std::sqrt(a * scale);
    factor.uv = factor.uu > T(0) ? b * scale / factor.uu : T(0);
    factor.vv = std::sqrt(std::max(c * scale - factor.uv * factor.uv, T(0)));
    return true;
}

// A deformed patch and where it was found: two rows in mm at the patch's depth, which is taken as constant. False behind the camera.
template <class T>
bool patch_rows(const defrec_camera& camera, Vec3<T> position, Pixel<T> found, const PatchCertainty<T>& factor, Row<T> rows[2]) {
    if (!(position.z > T(kLeastDepthMm))) return false;
    const T x = position.x / position.z, y = position.y / position.z;
    const T u = position.z * (x - (found.u - T(camera.cx)) / T(camera.fx));
    const T v = position.z * (y - (found.v - T(camera.cy)) / T(camera.fy));
    rows[0] = {{factor.uu, factor.uv, -(factor.uu * x + factor.uv * y)}, factor.uu * u + factor.uv * v};
    rows[1] = {{T(0), factor.vv, -factor.vv * y}, factor.vv * v};
    return true;
}

}  // namespace defrec
