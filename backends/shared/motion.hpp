// Rigid motions as unit dual quaternions, and the blending of control points' motions that
// docs/stages.md defines. Plain formulas on a scalar type T (float or double), one order of
// operations; used by align, lm, warp and the SDK.
#pragma once
#include <cmath>
#include <cstdint>

#include "backends/shared/motion_constants.h"
#include "include/defrec_c.h"

namespace defrec {

template <class T>
struct Vec3 {
    T x, y, z;
};
template <class T>
constexpr Vec3<T> operator+(Vec3<T> a, Vec3<T> b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
constexpr Vec3<T> operator-(Vec3<T> a, Vec3<T> b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
constexpr Vec3<T> operator*(T s, Vec3<T> a) {
    return {s * a.x, s * a.y, s * a.z};
}
template <class T>
constexpr T dot(Vec3<T> a, Vec3<T> b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
constexpr Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
constexpr Vec3<T> load3(const float* xyz) {
    return {T(xyz[0]), T(xyz[1]), T(xyz[2])};
}
template <class T>
constexpr void store3(Vec3<T> v, float* xyz) {
    xyz[0] = float(v.x);
    xyz[1] = float(v.y);
    xyz[2] = float(v.z);
}

// w + xi + yj + zk.
template <class T>
struct Quaternion {
    T w, x, y, z;
};
template <class T>
constexpr Quaternion<T> operator+(Quaternion<T> a, Quaternion<T> b) {
    return {a.w + b.w, a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
constexpr Quaternion<T> operator-(Quaternion<T> a, Quaternion<T> b) {
    return {a.w - b.w, a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
constexpr Quaternion<T> operator*(T s, Quaternion<T> q) {
    return {s * q.w, s * q.x, s * q.y, s * q.z};
}
template <class T>
constexpr Quaternion<T> operator*(Quaternion<T> a, Quaternion<T> b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
            a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
template <class T>
constexpr Quaternion<T> conjugate(Quaternion<T> q) {
    return {q.w, -q.x, -q.y, -q.z};
}
template <class T>
constexpr T dot(Quaternion<T> a, Quaternion<T> b) {
    return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
}

// x -> R x + t; real is the rotation, dual is t * real / 2. Unit: |real| = 1 and real . dual = 0.
template <class T>
struct DualQuaternion {
    Quaternion<T> real, dual;

    static constexpr DualQuaternion identity() {
        return {{T(1), T(0), T(0), T(0)}, {T(0), T(0), T(0), T(0)}};
    }
    static constexpr DualQuaternion load(const defrec_motion& m) {
        return {{T(m.real[0]), T(m.real[1]), T(m.real[2]), T(m.real[3])},
                {T(m.dual[0]), T(m.dual[1]), T(m.dual[2]), T(m.dual[3])}};
    }
    constexpr defrec_motion store() const {
        return {{float(real.w), float(real.x), float(real.y), float(real.z)},
                {float(dual.w), float(dual.x), float(dual.y), float(dual.z)}};
    }
};

// Makes the real part's length one whose square single precision holds, by a power of two. False
// where that is not finite, or less than 2^-126.
template <class T>
constexpr bool hold_length(DualQuaternion<T>& m, T& squared) {
    squared = dot(m.real, m.real);
    if (squared >= T(kLeastSquares) && squared <= T(kLargestFloat)) return true;
    const T scale = squared < T(1) ? T(kEnlarge) : T(kReduce);
    m = {scale * m.real, scale * m.dual};
    squared = dot(m.real, m.real);
    constexpr T kLeast = T(kLeastFloat * kEnlarge);
    return squared >= kLeast * kLeast && std::isfinite(squared);
}

// The nearest unit dual quaternion; the identity if |real| is less than 2^-126 or not finite.
template <class T>
constexpr DualQuaternion<T> normalise(DualQuaternion<T> m) {
    T squared{};
    if (!hold_length(m, squared)) return DualQuaternion<T>::identity();
    const T scale = T(1) / std::sqrt(squared);
    const Quaternion<T> real = scale * m.real, dual = scale * m.dual;
    return {real, dual - dot(real, dual) * real};
}

// R v.
template <class T>
constexpr Vec3<T> rotate(Quaternion<T> q, Vec3<T> v) {
    const Vec3<T> axis{q.x, q.y, q.z};
    return v + T(2) * cross(axis, cross(axis, v) + q.w * v);
}
template <class T>
constexpr Vec3<T> rotate(const DualQuaternion<T>& m, Vec3<T> v) {
    return rotate(m.real, v);
}

// t = 2 dual real*; a component of dual along real does not enter.
template <class T>
constexpr Vec3<T> translation(const DualQuaternion<T>& m) {
    const Quaternion<T> t = m.dual * conjugate(m.real);
    return {T(2) * t.x, T(2) * t.y, T(2) * t.z};
}

// R p + t.
template <class T>
constexpr Vec3<T> apply(const DualQuaternion<T>& m, Vec3<T> p) {
    return rotate(m.real, p) + translation(m);
}

// First b, then a.
template <class T>
constexpr DualQuaternion<T> compose(const DualQuaternion<T>& a, const DualQuaternion<T>& b) {
    return {a.real * b.real, a.real * b.dual + a.dual * b.real};
}
template <class T>
constexpr DualQuaternion<T> inverse(const DualQuaternion<T>& m) {
    return {conjugate(m.real), conjugate(m.dual)};
}

// Rotation given as a unit quaternion.
template <class T>
constexpr DualQuaternion<T> from_rigid(Quaternion<T> rotation, Vec3<T> t) {
    return {rotation, T(0.5) * (Quaternion<T>{T(0), t.x, t.y, t.z} * rotation)};
}

// The rotation by |r| radians about r.
template <class T>
constexpr Quaternion<T> rotation_from_vector(Vec3<T> r) {
    const T angle = std::sqrt(dot(r, r));
    const T half = T(0.5) * angle;
    const T scale = angle > T(1e-6) ? std::sin(half) / angle : T(0.5);
    const Quaternion<T> q{std::cos(half), scale * r.x, scale * r.y, scale * r.z};
    return (T(1) / std::sqrt(dot(q, q))) * q;
}

// rotation: row-major 3x3 rotation matrix. The quaternion's largest component is computed first
// (Shepperd 1978); w >= 0.
template <class T>
constexpr Quaternion<T> rotation_from_matrix(const T rotation[9]) {
    const T xx = rotation[0], yy = rotation[4], zz = rotation[8];
    const T four[4] = {T(1) + xx + yy + zz, T(1) + xx - yy - zz, T(1) - xx + yy - zz,
                       T(1) - xx - yy + zz};
    int largest = 0;
    for (int i = 1; i < 4; ++i)
        if (four[i] > four[largest]) largest = i;
    const T x = rotation[7] - rotation[5], y = rotation[2] - rotation[6],
            z = rotation[3] - rotation[1];
    const T xy = rotation[1] + rotation[3], xz = rotation[2] + rotation[6],
            yz = rotation[5] + rotation[7];
    const Quaternion<T> candidates[4] = {
        {four[0], x, y, z}, {x, four[1], xy, xz}, {y, xy, four[2], yz}, {z, xz, yz, four[3]}};
    const Quaternion<T> q = candidates[largest];
    const T scale = (q.w < T(0) ? T(-1) : T(1)) / std::sqrt(dot(q, q));
    return scale * q;
}

// rotation: row-major 3x3 rotation matrix; t: 3.
template <class T>
constexpr DualQuaternion<T> from_rigid(const T rotation[9], const T t[3]) {
    return from_rigid(rotation_from_matrix(rotation), Vec3<T>{t[0], t[1], t[2]});
}

// The inverse of from_rigid; m must be unit.
template <class T>
constexpr void to_rigid(const DualQuaternion<T>& m, T rotation[9], T t[3]) {
    const Vec3<T> columns[3] = {rotate(m, Vec3<T>{T(1), T(0), T(0)}),
                                rotate(m, Vec3<T>{T(0), T(1), T(0)}),
                                rotate(m, Vec3<T>{T(0), T(0), T(1)})};
    for (int c = 0; c < 3; ++c) {
        rotation[0 + c] = columns[c].x;
        rotation[3 + c] = columns[c].y;
        rotation[6 + c] = columns[c].z;
    }
    const Vec3<T> v = translation(m);
    t[0] = v.x;
    t[1] = v.y;
    t[2] = v.z;
}

// The motion of a point moved by DEFREC_BLEND_NODES control points (docs/stages.md): dual
// quaternion blending (Kavan et al. 2008), real part of length 1. motion_at(k) gives the
// DualQuaternion<T> of control point k. Where the sum vanishes: the first control point's motion.
template <class T, class MotionAt>
constexpr DualQuaternion<T> blend_with(MotionAt&& motion_at, const int32_t node[DEFREC_BLEND_NODES],
                                       const float weight[DEFREC_BLEND_NODES]) {
    const DualQuaternion<T> first = motion_at(node[0]);
    Quaternion<T> real = T(weight[0]) * first.real, dual = T(weight[0]) * first.dual;
    for (int k = 1; k < DEFREC_BLEND_NODES; ++k) {
        const DualQuaternion<T> m = motion_at(node[k]);
        const T w = dot(m.real, first.real) < T(0) ? -T(weight[k]) : T(weight[k]);
        real = real + w * m.real;
        dual = dual + w * m.dual;
    }
    const T length = std::sqrt(dot(real, real));
    if (!(length > T(kMinBlendLength))) return first;
    const T scale = T(1) / length;
    return {scale * real, scale * dual};
}
template <class T>
constexpr DualQuaternion<T> blend(const defrec_motion* motions,
                                  const int32_t node[DEFREC_BLEND_NODES],
                                  const float weight[DEFREC_BLEND_NODES]) {
    return blend_with<T>([motions](int32_t k) { return DualQuaternion<T>::load(motions[k]); }, node,
                         weight);
}
template <class T>
constexpr DualQuaternion<T> blend(const DualQuaternion<T>* motions,
                                  const int32_t node[DEFREC_BLEND_NODES],
                                  const float weight[DEFREC_BLEND_NODES]) {
    return blend_with<T>([motions](int32_t k) { return motions[k]; }, node, weight);
}

}  // namespace defrec
