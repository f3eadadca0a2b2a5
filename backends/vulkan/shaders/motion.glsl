// Rigid motions as unit dual quaternions, and their blending: backends/shared/motion.hpp and
// usable_motion of backends/stages/surface.hpp in single precision. Needs records.glsl. A
// quaternion w + xi + yj + zk is the vec4 (x, y, z, w).
#include "backends/stages/surface.hpp"

struct DualQuaternion {  // x -> R x + t; real is the rotation, dual is t * real / 2
    vec4 real, dual;
};

const DualQuaternion kIdentityMotion = DualQuaternion(vec4(0, 0, 0, 1), vec4(0));

vec3 load3(float xyz[3]) { return vec3(xyz[0], xyz[1], xyz[2]); }
float[3] store3(vec3 v) { return float[3](v.x, v.y, v.z); }

vec4 load_quaternion(float wxyz[4]) { return vec4(wxyz[1], wxyz[2], wxyz[3], wxyz[0]); }
float[4] store_quaternion(vec4 q) { return float[4](q.w, q.x, q.y, q.z); }
DualQuaternion load_motion(Motion m) {
    return DualQuaternion(load_quaternion(m.real), load_quaternion(m.dual));
}
Motion store_motion(DualQuaternion m) {
    return Motion(store_quaternion(m.real), store_quaternion(m.dual));
}

vec4 multiply(vec4 a, vec4 b) {
    return vec4(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}
vec4 conjugate(vec4 q) { return vec4(-q.xyz, q.w); }

// Compilers may assume that no NaN occurs; bits cannot be assumed away.
bool finite(vec4 v) { return all(notEqual(floatBitsToUint(v) & 0x7f800000u, uvec4(0x7f800000u))); }

// Makes the real part's length one whose square is held, by a power of two. False where that is not
// finite, or less than 2^-126.
bool hold_length(inout DualQuaternion m, out float squared) {
    squared = dot(m.real, m.real);
    if (finite(vec4(squared)) && squared >= kLeastSquares) return true;
    const float scale = finite(vec4(squared)) ? kEnlarge : kReduce;
    // Not the square of the factor times that of the length.
    precise const vec4 real = scale * m.real;
    precise const float held = dot(real, real);
    m = DualQuaternion(real, scale * m.dual);
    squared = held;
    const float least = kLeastFloat * kEnlarge;
    return finite(vec4(squared)) && squared >= least * least;
}

// The nearest unit dual quaternion; the identity where the given one has no finite value or no
// rotation.
DualQuaternion normalise_motion(DualQuaternion m) {
    float squared;
    if (!finite(m.real) || !finite(m.dual) || !hold_length(m, squared)) return kIdentityMotion;
    const float scale = inversesqrt(squared);
    const vec4 real = scale * m.real, dual = scale * m.dual;
    return DualQuaternion(real, dual - dot(real, dual) * real);
}
DualQuaternion usable_motion(Motion m) { return normalise_motion(load_motion(m)); }

// R v.
vec3 rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
vec3 rotate(DualQuaternion m, vec3 v) { return rotate(m.real, v); }

// t = 2 dual real*; a component of dual along real does not enter.
vec3 translation(DualQuaternion m) { return 2.0 * multiply(m.dual, conjugate(m.real)).xyz; }

// R p + t.
vec3 apply(DualQuaternion m, vec3 p) { return rotate(m.real, p) + translation(m); }

// First b, then a.
DualQuaternion compose(DualQuaternion a, DualQuaternion b) {
    return DualQuaternion(multiply(a.real, b.real),
                          multiply(a.real, b.dual) + multiply(a.dual, b.real));
}

// Rotation given as a unit quaternion.
DualQuaternion from_rigid(vec4 rotation, vec3 t) {
    return DualQuaternion(rotation, 0.5 * multiply(vec4(t, 0), rotation));
}

// The motion of a point moved by four control points (docs/stages.md), real part of length 1. Where
// the sum vanishes or is not finite: the first's.
DualQuaternion blend(DualQuaternion m[4], float weight[4]) {
    vec4 real = weight[0] * m[0].real, dual = weight[0] * m[0].dual;
    for (int k = 1; k < 4; ++k) {
        const float w = dot(m[k].real, m[0].real) < 0.0 ? -weight[k] : weight[k];
        real += w * m[k].real;
        dual += w * m[k].dual;
    }
    const float length2 = dot(real, real);
    if (!finite(vec4(length2)) || !(length2 > kMinBlendLength * kMinBlendLength)) return m[0];
    const float scale = inversesqrt(length2);
    return DualQuaternion(scale * real, scale * dual);
}
