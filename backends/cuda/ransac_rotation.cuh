// The rotation that fits matched points best, by every thread for itself. docs/stages/ransac.md.
#pragma once
#include "backends/cuda/device/device_code.hpp"
#include "backends/shared/motion.hpp"

namespace defrec::cuda {
namespace {

// Row-major.
struct Rotation {
    float r[9];
};

// b - R a.
__device__ inline Vec3<float> rest_of(const Rotation& rotation, const Vec3<float>& a,
                                      const Vec3<float>& b) {
    const float* r = rotation.r;
    return {fmaf(-r[0], a.x, fmaf(-r[1], a.y, fmaf(-r[2], a.z, b.x))),
            fmaf(-r[3], a.x, fmaf(-r[4], a.y, fmaf(-r[5], a.z, b.y))),
            fmaf(-r[6], a.x, fmaf(-r[7], a.y, fmaf(-r[8], a.z, b.z)))};
}
__device__ inline float squared_length(const Vec3<float>& v) {
    return fmaf(v.x, v.x, fmaf(v.y, v.y, v.z * v.z));
}

__device__ float dot(const float4& a, const float4& b) {
    return fmaf(a.x, b.x, fmaf(a.y, b.y, fmaf(a.z, b.z, a.w * b.w)));
}
__device__ float4 scaled(float s, const float4& v) {
    return make_float4(s * v.x, s * v.y, s * v.z, s * v.w);
}

// Symmetric 4x4, by rows.
struct Symmetric {
    float4 x, y, z, w;
};
__device__ float trace(const Symmetric& m) { return (m.x.x + m.y.y) + (m.z.z + m.w.w); }
__device__ Symmetric scaled(float s, const Symmetric& m) {
    return {scaled(s, m.x), scaled(s, m.y), scaled(s, m.z), scaled(s, m.w)};
}
__device__ Symmetric squared(const Symmetric& m) {
    const float xy = dot(m.x, m.y), xz = dot(m.x, m.z), xw = dot(m.x, m.w), yz = dot(m.y, m.z),
                yw = dot(m.y, m.w), zw = dot(m.z, m.w);
    return {make_float4(dot(m.x, m.x), xy, xz, xw), make_float4(xy, dot(m.y, m.y), yz, yw),
            make_float4(xz, yz, dot(m.z, m.z), zw), make_float4(xw, yw, zw, dot(m.w, m.w))};
}

// A unit eigenvector of the largest eigenvalue of m, none of whose eigenvalues is negative.
// Squaring m again and again leaves nothing but that eigenvector times itself; where the eigenvalue
// is a double one, some vector of its plane.
__device__ float4 dominant_eigenvector(Symmetric m) {
    constexpr int kRounds =
        5;  // of four squarings: tells eigenvalues apart that differ by 1e-5 of their size
    constexpr float kNearlyOne =
        0.999f;  // of trace(m^2) where trace(m) is 1: one squaring more leaves 1e-6 of the others
    for (int round = 0; round < kRounds; ++round) {
        const float root = rsqrtf(trace(m));
        m = squared(scaled(root * root, m));
        const bool alone = trace(m) > kNearlyOne;
        m = squared(m);
        if (alone) break;
        m = squared(squared(m));
    }
    float4 column = m.x;
    float largest = m.x.x;
    const auto prefer = [&](const float4& other, float diagonal) {
        if (!(diagonal > largest)) return;
        largest = diagonal;
        column = other;
    };
    prefer(m.y, m.y.y);
    prefer(m.z, m.z.z);
    prefer(m.w, m.w.w);
    return scaled(rsqrtf(dot(column, column)), column);
}

// The rotation R that maximises the sum of R_ij m_ij, never a reflection: Horn's (1987) quaternion,
// w last. Where it is not unique it is one of the best; the identity for a matrix that is zero or
// not finite.
__device__ inline float4 nearest_quaternion(const float m[9]) {
    float squares = 0;
    for (int i = 0; i < 9; ++i) squares = fmaf(m[i], m[i], squares);
    if (!(squares > 1e-30f && squares < 1e38f)) return make_float4(0, 0, 0, 1);
    const float scale = rsqrtf(squares);
    constexpr float kShift = 1.7320508f;  // no eigenvalue is below -sqrt(3) |m|
    const auto at = [&](int i, int j) { return scale * m[3 * i + j]; };
    const float xx = at(0, 0), yy = at(1, 1), zz = at(2, 2);
    const float wx = at(2, 1) - at(1, 2), wy = at(0, 2) - at(2, 0), wz = at(1, 0) - at(0, 1);
    const float xy = at(0, 1) + at(1, 0), xz = at(0, 2) + at(2, 0), yz = at(1, 2) + at(2, 1);
    return dominant_eigenvector({make_float4(kShift + xx - yy - zz, xy, xz, wx),
                                 make_float4(xy, kShift + yy - xx - zz, yz, wy),
                                 make_float4(xz, yz, kShift + zz - xx - yy, wz),
                                 make_float4(wx, wy, wz, kShift + xx + yy + zz)});
}
__device__ inline Rotation nearest_rotation(const float m[9]) {
    const float4 q = nearest_quaternion(m);
    return {{1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.w * q.z),
             2 * (q.x * q.z + q.w * q.y),  //
             2 * (q.x * q.y + q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z),
             2 * (q.y * q.z - q.w * q.x),  //
             2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x),
             1 - 2 * (q.x * q.x + q.y * q.y)}};
}

}  // namespace
}  // namespace defrec::cuda
