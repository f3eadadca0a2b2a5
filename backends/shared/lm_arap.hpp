// The as-rigid-as-possible term of stage lm for one edge (the paper's f_ARAP): cost, gradient and
// 6x6 blocks. Formulas on a scalar type T; docs/stages/lm.md derives them. Increments of a control
// point are (omega, tau): x' = exp(omega) (x - c) + c + tau about its position c.
#pragma once
#include <algorithm>
#include <cmath>

#include "backends/shared/lm_constants.h"
#include "backends/shared/motion.hpp"

namespace defrec {

// A control point in motion: its rotation, and where it is now.
template <class T>
struct NodePose {
    Quaternion<T> rotation;
    Vec3<T> position;
};

// Weights of one edge, its own and the data's included; angle and rotation weights already hold the
// squared node spacing (mm^2).
template <class T>
struct ArapWeights {
    T length, angle, rotation;
};

template <class T>
struct ArapTerm {
    T cost;
    T gradient_a[6], gradient_b[6];
    T aa[36], bb[36], ab[36];  // row-major
};

namespace detail {
// block (3x3 at row, column of a 6x6) += scale * m
template <class T>
constexpr void add3(T* block, int row, int column, T scale, const T m[9]) {
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) block[(row + r) * 6 + column + c] += scale * m[r * 3 + c];
}
template <class T>
constexpr void cross_matrix(Vec3<T> v, T m[9]) {
    m[0] = m[4] = m[8] = T(0);
    m[1] = -v.z;
    m[2] = v.y;
    m[3] = v.z;
    m[5] = -v.x;
    m[6] = -v.y;
    m[7] = v.x;
}
template <class T>
constexpr void multiply3(const T a[9], const T b[9], T m[9]) {
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            m[r * 3 + c] = a[r * 3] * b[c] + a[r * 3 + 1] * b[3 + c] + a[r * 3 + 2] * b[6 + c];
}
// I - v v^T
template <class T>
constexpr void projector(Vec3<T> v, T m[9]) {
    const T e[3] = {v.x, v.y, v.z};
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) m[r * 3 + c] = T(r == c ? 1 : 0) - e[r] * e[c];
}
// With G(q) the derivative of (0, omega) q by omega: G(p)^T G(q), from p q*.
template <class T>
constexpr void rotation_coupling(Quaternion<T> relative, T m[9]) {
    cross_matrix(Vec3<T>{relative.x, relative.y, relative.z}, m);
    for (int i = 0; i < 3; ++i) m[4 * i] = relative.w;
}
template <class T>
constexpr void add_gradient(T gradient[6], int at, T scale, Vec3<T> v) {
    gradient[at] += scale * v.x;
    gradient[at + 1] += scale * v.y;
    gradient[at + 2] += scale * v.z;
}
}  // namespace detail

// What an edge's residuals are made of.
template <class T>
struct ArapGeometry {
    Vec3<T> now;        // unit, from a to b
    Vec3<T> turned_a;   // where a's motion takes the rest direction from a to b; unit
    Vec3<T> turned_b;   // where b's motion takes the rest direction from b to a; unit
    T length, stretch;  // mm: now, and now minus at rest
    Quaternion<T> qb;   // b's rotation in the hemisphere of a's
};
template <class T>
constexpr ArapGeometry<T> arap_geometry(const NodePose<T>& a, const NodePose<T>& b,
                                        Vec3<T> rest_direction, T rest_length) {
    const Vec3<T> along = b.position - a.position;
    const T length = std::sqrt(dot(along, along)), divisor = std::max(length, T(kMinLengthMm));
    const T sign = dot(a.rotation, b.rotation) < T(0) ? T(-1) : T(1);
    return {(T(1) / divisor) * along,
            rotate(a.rotation, rest_direction),
            rotate(b.rotation, T(-1) * rest_direction),
            divisor,
            length - rest_length,
            sign * b.rotation};
}

// Both directions of the edge: 2 length^2, |angle_ab|^2 + |angle_ba|^2, 2 |rotation|^2, each with
// its weight.
template <class T>
constexpr T arap_cost(const ArapGeometry<T>& g, Quaternion<T> qa, const ArapWeights<T>& w) {
    const Vec3<T> ab = g.turned_a - g.now, ba = g.turned_b + g.now;
    const Quaternion<T> turn = qa - g.qb;
    return T(2) * (w.length * g.stretch * g.stretch + w.rotation * dot(turn, turn)) +
           w.angle * (dot(ab, ab) + dot(ba, ba));
}

template <class T>
constexpr ArapTerm<T> arap_term(const ArapGeometry<T>& g, Quaternion<T> qa,
                                const ArapWeights<T>& w) {
    using namespace detail;
    ArapTerm<T> term{};
    term.cost = arap_cost(g, qa, w);

    T across[9], turning_a[9], turning_b[9], coupling[9], product[9], cross_a[9], cross_b[9];
    projector(g.now, across);
    projector(g.turned_a, turning_a);
    projector(g.turned_b, turning_b);
    const Quaternion<T> relative = qa * conjugate(g.qb);
    rotation_coupling(relative, coupling);
    cross_matrix(g.turned_a, cross_a);
    cross_matrix(g.turned_b, cross_b);

    const T bend = T(2) * w.angle / (g.length * g.length), half_rotation = w.rotation / T(2);
    T shift[9];  // both length and angles, by the difference of the translations
    const T e[3] = {g.now.x, g.now.y, g.now.z};
    for (int i = 0; i < 9; ++i) shift[i] = bend * across[i] + T(2) * w.length * e[i / 3] * e[i % 3];
    add3(term.aa, 3, 3, T(1), shift);
    add3(term.bb, 3, 3, T(1), shift);
    add3(term.ab, 3, 3, T(-1), shift);

    add3(term.aa, 0, 0, w.angle, turning_a);
    add3(term.bb, 0, 0, w.angle, turning_b);
    for (int i = 0; i < 3; ++i) {
        term.aa[7 * i] += half_rotation;
        term.bb[7 * i] += half_rotation;
    }
    add3(term.ab, 0, 0, -half_rotation, coupling);

    const auto couple = [&](T* block, int row, int column, T scale, const T m[9], bool transposed) {
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c)
                block[(row + r) * 6 + column + c] +=
                    scale * (transposed ? m[c * 3 + r] : m[r * 3 + c]);
    };
    const T lever = w.angle / g.length;
    multiply3(cross_a, across, product);  // omega_a against tau_a (+) and tau_b (-)
    couple(term.aa, 0, 3, lever, product, false);
    couple(term.aa, 3, 0, lever, product, true);
    couple(term.ab, 0, 3, -lever, product, false);
    multiply3(cross_b, across, product);  // omega_b against tau_b (+) and tau_a (-)
    couple(term.bb, 0, 3, lever, product, false);
    couple(term.bb, 3, 0, lever, product, true);
    couple(term.ab, 3, 0, -lever, product, true);

    const Vec3<T> turn{relative.x, relative.y, relative.z};
    add_gradient(term.gradient_a, 0, -w.angle, cross(g.turned_a, g.now));
    add_gradient(term.gradient_b, 0, w.angle, cross(g.turned_b, g.now));
    add_gradient(term.gradient_a, 0, w.rotation, turn);
    add_gradient(term.gradient_b, 0, -w.rotation, turn);
    const Vec3<T> lean = g.turned_b - g.turned_a;
    const Vec3<T> pull =
        T(2) * w.length * g.stretch * g.now + lever * (lean - dot(lean, g.now) * g.now);
    add_gradient(term.gradient_b, 3, T(1), pull);
    add_gradient(term.gradient_a, 3, T(-1), pull);
    return term;
}

}  // namespace defrec
