// The terms of the cost that stage lm minimises, each for one residual: robust kernels, surface
// residuals with their Jacobians. Formulas on a scalar type T; docs/stages/lm.md derives them. The
// ARAP term is in lm_arap.hpp, the minimiser in levenberg_marquardt.hpp.
#pragma once
#include <algorithm>
#include <cmath>

#include "backends/shared/live_depth.hpp"
#include "backends/shared/lm_constants.h"

namespace defrec {

// A residual's share of the cost, and the weight of its square in the linearised system.
template <class T>
struct Robust {
    T cost, weight;
};

// Tukey's kernel of a squared residual: weight (1 - x)^2 with x = squared / c^2, cost its integral.
// c > 0.
template <class T>
constexpr Robust<T> tukey(T squared, T inverse_c2) {
    const T x = std::min(squared * inverse_c2, T(1));
    const T rest = T(1) - x;
    return {(T(1) - rest * rest * rest) / (T(3) * inverse_c2), rest * rest};
}

// The paper's weight of matches that were not preselected, 1 - d / a up to d = a, times Tukey's;
// cost its integral. A distance that is no finite number is beyond.
template <class T>
constexpr Robust<T> ramped_tukey(T squared, T inverse_a, T inverse_c2) {
    const T farthest = std::min(T(1) / inverse_a, T(1) / std::sqrt(inverse_c2));
    // Rounding leaves x short of 1 there, and a tiny weight, by which outliers alone would pull.
    const bool beyond = !(squared < farthest * farthest);
    const T distance = beyond ? farthest : std::sqrt(squared);
    const T d2 = distance * distance;
    const T x = d2 * inverse_c2;
    const T rest = T(1) - x;
    const T ramp = T(1) - distance * inverse_a;
    const T lost = T(2) * distance * inverse_a * (T(1) / T(3) - x * (T(2) / T(5)) + x * x / T(7));
    return {d2 * (T(1) - x + x * x / T(3) - lost),
            beyond ? T(0) : std::max(ramp, T(0)) * rest * rest};
}

// A residual along one direction: value is its size, gradient its derivative by the deformed
// point's position.
template <class T>
struct Row {
    Vec3<T> gradient;
    T value;
};

// Point to plane: how far the live surface lies from a deformed point, along the point's normal,
// mm. False where no live surface is associated with the point.
template <class T>
constexpr bool icp_row(const defrec_camera& camera, const DisparityImage& image, T association_mm,
                       Vec3<T> position, Vec3<T> normal, Row<T>& row) {
    Pixel<T> pixel;
    if (!project_inside(camera, image, position, pixel)) return false;
    const T depth = live_depth(camera, image, pixel);
    if (!(depth > T(0))) return false;
    const T range = std::sqrt(dot(position, position)), slope = dot(normal, position);
    const T difference =
        (depth - position.z) / position.z;  // of the positions, in units of the point's own
    if (!(-slope >= T(kMinFacing) * range) || !(std::abs(difference) * range <= association_mm))
        return false;
    row = {T(-1) * normal, difference * slope};
    return true;
}

// Where a point of the template was seen in the live image: the direction of its ray, how certain
// that is across the ray, and maybe how deep.
template <class T>
struct Sighting {
    T u, v;         // x / z, y / z of the ray
    T uu, uv, vv;   // Cholesky factor [uu 0; uv vv] of the information across the ray
    T depth, root;  // mm; square root of the weight of an error in depth, 0 where depth is unknown
};

template <class T>
constexpr Sighting<T> match_sighting(Vec3<T> live) {
    return {live.x / live.z,
            live.y / live.z,
            T(1),
            T(0),
            T(1),
            live.z,
            T(std::sqrt(kMatchDepthWeight))};
}

// Information more than 1 along some direction is scaled down. False where there is no information,
// or none that can be used.
template <class T>
constexpr bool patch_sighting(const defrec_camera& camera, const defrec_patch_observation& seen,
                              Sighting<T>& sighting) {
    T a = T(seen.information[0]), b = T(seen.information[1]), c = T(seen.information[2]);
    T one = T(1);
    constexpr T kLargest = T(kEnlarge / 16);  // squares of numbers beyond may overflow
    if (!(a <= kLargest && std::abs(b) <= kLargest && c <= kLargest)) {
        a *= T(kReduce);
        b *= T(kReduce);
        c *= T(kReduce);
        one = T(kReduce);
    }
    const T half = (a - c) / T(2);
    const T largest = (a + c) / T(2) + std::sqrt(half * half + b * b);
    if (seen.valid != 1 || !std::isfinite(largest) || !(largest > T(0)) || !(a >= T(0)) ||
        !(c >= T(0)))
        return false;
    const T scale = T(1) / std::max(largest, one);
    const T uu = std::sqrt(a * scale), uv = uu > T(0) ? b * scale / uu : T(0);
    const T vv = std::sqrt(std::max(c * scale - uv * uv, T(0)));
    sighting = {(T(seen.u) / T(kPatchOne) - T(camera.cx)) / T(camera.fx),
                (T(seen.v) / T(kPatchOne) - T(camera.cy)) / T(camera.fy),
                uu,
                uv,
                vv,
                T(0),
                T(0)};
    return true;
}

// How far a deformed point lies from the ray, mm at its own depth, and from the depth.
template <class T>
constexpr void sighting_rows(Vec3<T> position, const Sighting<T>& seen, Row<T> rows[3]) {
    const T across = position.x - seen.u * position.z, down = position.y - seen.v * position.z;
    rows[0] = {{seen.uu, seen.uv, -(seen.uu * seen.u + seen.uv * seen.v)},
               seen.uu * across + seen.uv * down};
    rows[1] = {{T(0), seen.vv, -seen.vv * seen.v}, seen.vv * down};
    rows[2] = {{T(0), T(0), seen.root}, seen.root * (position.z - seen.depth)};
}

// px for one mm across the ray of a point at this depth.
template <class T>
constexpr T px_per_mm(const defrec_camera& camera, T depth) {
    return T(camera.fx) / std::max(depth, T(kMinDepthMm));
}

}  // namespace defrec
