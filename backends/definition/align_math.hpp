// Formulas of the stage align that every backend shares: prediction, levels, the reciprocal square
// root, the fit of the peak. docs/stages/align.md explains them; search and sampling are each
// backend's own.
#pragma once
#include <bit>
#include <cmath>
#include <cstdint>

#include "backends/shared/motion.hpp"
#include "backends/stages/align.hpp"

namespace defrec::align {

// Coordinates of level 0 to those of a level and back, 1/256 px: pixel centres of a level lie
// between those below it.
constexpr int32_t to_level(int32_t position, uint32_t level) {
    return ((position + 128 + ((1 << level) >> 1)) >> level) - 128;
}
constexpr int32_t from_level(int32_t position, uint32_t level) {
    return (position + 128) * (1 << level) - 128;
}

// px to 1/256 px; false if it is not finite or far outside every image.
constexpr bool to_fixed(double px, int32_t& out) {
    if (!(std::abs(px) < 16384.0)) return false;
    out = int32_t(std::floor(px * kPatchOne + 0.5));
    return true;
}

// 1 / sqrt(x) for x >= 1 from nothing but exact operations: the bit trick and three Newton steps.
constexpr float reciprocal_sqrt(float x) {
    const float half = 0.5f * x;
    float y = std::bit_cast<float>(0x5f3759dfu - (std::bit_cast<uint32_t>(x) >> 1));
    for (int i = 0; i < 3; ++i) y = y * (1.5f - (half * y) * y);
    return y;
}

// The same motion with a real part of length 1; as it is where that has no length or is not finite.
template <class T>
constexpr DualQuaternion<T> with_unit_rotation(const DualQuaternion<T>& m) {
    if (std::abs(dot(m.real, m.real) - T(1)) <= T(kUnitTolerance)) return m;
    DualQuaternion<T> held = m;
    T squared{};
    if (!hold_length(held, squared)) return m;
    const T scale = T(1) / std::sqrt(squared);
    return {scale * held.real, scale * held.dual};
}

// Where a patch is expected, and how the view's pixels map there.
template <class T>
constexpr defrec_patch_prediction predict(const defrec_patch& patch,
                                          const defrec_patch_slope& slope,
                                          const defrec_motion* motions,
                                          const defrec_align_params& params) {
    defrec_patch_prediction out{};
    const defrec_camera& camera = params.camera;
    const auto motion_of = [motions](int32_t node) {
        return with_unit_rotation(DualQuaternion<T>::load(motions[node]));
    };
    const DualQuaternion<T> motion = blend_with<T>(motion_of, patch.node, patch.weight);
    const bool right = params.right_view != 0;
    const T live_x = right ? T(camera.baseline_mm) : T(0),
            live_cx = T(right ? camera.cx + camera.disparity_offset_px : camera.cx);
    const Vec3<T> rest = load3<T>(patch.position), moved = apply(motion, rest),
                  p = moved - Vec3<T>{live_x, 0, 0};
    if (!(p.z > T(kMinPatchDepthMm))) return out;
    const T fx = T(camera.fx) / p.z, fy = T(camera.fy) / p.z;
    const T x = p.x / p.z, y = p.y / p.z;
    const T u = T(camera.fx) * x + live_cx, v = T(camera.fy) * y + T(camera.cy);
    const T margin = T((params.patch_radius + 2) << params.level);
    if (!(u >= margin && v >= margin && u <= T(params.width - 1) - margin &&
          v <= T(params.height - 1) - margin))
        return out;

    Vec3<T> a = rotate(motion, load3<T>(patch.tangent_u)),
            b = rotate(motion, load3<T>(patch.tangent_v));
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
        const Vec3<T> apart = apply(motion_of(patch.node[k]), rest) - moved;
        a = a + T(slope.weight_u[k]) * apart;
        b = b + T(slope.weight_v[k]) * apart;
    }
    const T j00 = fx * (a.x - x * a.z), j01 = fx * (b.x - x * b.z);
    const T j10 = fy * (a.y - y * a.z), j11 = fy * (b.y - y * b.z);
    const T det = j00 * j11 - j01 * j10;
    const T half_sum = T(0.5) * (j00 * j00 + j01 * j01 + j10 * j10 + j11 * j11);
    const T largest2 = half_sum + std::sqrt(std::fmax(half_sum * half_sum - det * det, T(0)));
    // Not mirrored, and not stretched too much.
    if (!(det > T(0) && largest2 <= T(kMaxStretch2) && det * det >= T(kMinStretch2) * largest2))
        return out;

    to_fixed(double(u), out.u);
    to_fixed(double(v), out.v);
    const T scale = T(kPatchMatrixOne) / det;
    const T inverse[4] = {scale * j11, -scale * j01, -scale * j10, scale * j00};
    for (int i = 0; i < 4; ++i) out.view_from_live[i] = int32_t(std::floor(inverse[i] + T(0.5)));
    out.valid = 1;
    return out;
}

// Whether a prediction, which may be a caller's, can be followed without leaving the ranges of
// fixed point.
constexpr bool usable(const defrec_patch_prediction& p, const defrec_align_params& params) {
    if (p.valid != 1 || p.u < 0 || p.v < 0 || p.u > int32_t(params.width - 1) * kPatchOne ||
        p.v > int32_t(params.height - 1) * kPatchOne)
        return false;
    for (const int32_t m : p.view_from_live)
        if (m < -kMaxMatrix || m > kMaxMatrix) return false;
    return true;
}

// A patch that is not found, where it is predicted. q: its score there, kUnscored where it has
// none.
constexpr defrec_patch_observation predicted_observation(const defrec_patch_prediction& prediction,
                                                         int32_t q,
                                                         const defrec_align_params& params) {
    defrec_patch_observation out{};
    const int32_t score = (q < kOneScore ? q : kOneScore) >> kScoreShift;
    if (q == kUnscored || score < int32_t(params.min_score)) return out;
    out.u = prediction.u;
    out.v = prediction.v;
    out.score = score;
    out.valid = 1;
    return out;
}

// Sums over a patch's usable pixels: x and y the offset from its centre, t the template, gx and gy
// its gradient, i the live image; docs/stages/align.md.
struct TemplateSums {
    int32_t n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    int32_t t = 0, gx = 0, gy = 0, xt = 0, yt = 0, xgx = 0, ygx = 0, xgy = 0, ygy = 0;
    int32_t tt = 0, gxx = 0, gxy = 0, gyy = 0, gxt = 0, gyt = 0;
};
struct LiveSums {
    int32_t i = 0, xi = 0, yi = 0, ii = 0, it = 0, igx = 0, igy = 0;
};

// An image's sum over the patch, and its moments along the two axes of LightFit.
struct LightMoments {
    float sum, x, y;
};

// What differences of the light explain of an image: an offset and, with a gradient, a plane over
// the patch. The axes are x and what y has beyond x over the usable pixels, about their mean.
// Floats, exact operations only, here and below.
struct LightFit {
    float inverse_n, x, y;         // 1 / n, sums of x and y
    float skew;                    // of y by x
    float inverse_xx, inverse_yy;  // of the axes' own moments; 0 without a gradient

    constexpr LightMoments moments(int32_t a, int32_t xa, int32_t ya) const {
        const float sum = float(a), along_x = float(xa) - (x * sum) * inverse_n;
        return {sum, along_x, (float(ya) - (y * sum) * inverse_n) - skew * along_x};
    }
    // What is left of the sum of products of a and b.
    constexpr float rest(int32_t ab, const LightMoments& a, const LightMoments& b) const {
        return ((float(ab) - (a.sum * b.sum) * inverse_n) - (a.x * b.x) * inverse_xx) -
               (a.y * b.y) * inverse_yy;
    }
};
constexpr float reciprocal(float x) {
    const float root = reciprocal_sqrt(x);
    return root * root;
}
constexpr LightFit make_light_fit(const TemplateSums& s, float inverse_n, bool has_gradient) {
    LightFit out{};
    out.inverse_n = inverse_n;
    if (!has_gradient) return out;
    out.x = float(s.x);
    out.y = float(s.y);
    const float xx = float(s.xx) - (out.x * out.x) * inverse_n,
                xy = float(s.xy) - (out.x * out.y) * inverse_n,
                yy = float(s.yy) - (out.y * out.y) * inverse_n;
    out.inverse_xx = reciprocal(xx);
    out.skew = xy * out.inverse_xx;
    out.inverse_yy = reciprocal(yy - out.skew * xy);
    return out;
}

// Without a gradient, and with one.
struct LightFits {
    LightFit even, sloped;
};
constexpr LightFits make_light_fits(const TemplateSums& s, float inverse_n) {
    return {make_light_fit(s, inverse_n, false), make_light_fit(s, inverse_n, true)};
}

// The normal equations of the shift between template and live image; gain and light eliminated.
struct ShiftSystem {
    LightFit light;
    LightMoments t, gx, gy;
    float inverse_tt, tt, gx_t, gy_t;
    float xx, xy,
        yy;  // damped, so that a direction without texture stays where it is
    float inverse_determinant;
    float raw_xx, raw_yy;  // not damped
    bool solvable;
};
constexpr ShiftSystem make_shift_system(const TemplateSums& s, const LightFit& light) {
    ShiftSystem out{};
    out.light = light;
    out.t = light.moments(s.t, s.xt, s.yt);
    out.gx = light.moments(s.gx, s.xgx, s.ygx);
    out.gy = light.moments(s.gy, s.xgy, s.ygy);
    out.tt = light.rest(s.tt, out.t, out.t);
    if (!(out.tt >= 1.0f)) return out;
    out.inverse_tt = reciprocal(out.tt);
    out.gx_t = light.rest(s.gxt, out.gx, out.t);
    out.gy_t = light.rest(s.gyt, out.gy, out.t);
    out.raw_xx = light.rest(s.gxx, out.gx, out.gx) - (out.gx_t * out.gx_t) * out.inverse_tt;
    out.raw_yy = light.rest(s.gyy, out.gy, out.gy) - (out.gy_t * out.gy_t) * out.inverse_tt;
    out.xy = light.rest(s.gxy, out.gx, out.gy) - (out.gx_t * out.gy_t) * out.inverse_tt;
    const float damping = (out.raw_xx + out.raw_yy) * kShiftDamping;
    out.xx = out.raw_xx + damping;
    out.yy = out.raw_yy + damping;
    const float determinant = out.xx * out.yy - out.xy * out.xy;
    if (!(determinant >= 1.0f) || !(damping > 0.0f)) return out;
    out.inverse_determinant = reciprocal(determinant);
    out.solvable = true;
    return out;
}

// A Gauss-Newton step of the shift, 1/256 px, and the ZNCC before it, 1/65536.
struct ShiftStep {
    int32_t x, y, score;
    float rest;  // of the live image's squares that the template does not explain
    bool valid;  // the images correlate, and the step is not too long

    constexpr bool is_short() const {
        return x >= -kShortStep && x <= kShortStep && y >= -kShortStep && y <= kShortStep;
    }
};
constexpr ShiftStep shift_step(const ShiftSystem& system, const LiveSums& s) {
    ShiftStep out{};
    if (!system.solvable) return out;
    const LightFit& light = system.light;
    const LightMoments i = light.moments(s.i, s.xi, s.yi);
    const float ii = light.rest(s.ii, i, i), it = light.rest(s.it, i, system.t);
    if (!(ii >= 1.0f) || !(it >= 1.0f)) return out;
    const float gain = it * system.inverse_tt, inverse_gain = system.tt * reciprocal(it);
    const float x = light.rest(s.igx, i, system.gx) - gain * system.gx_t,
                y = light.rest(s.igy, i, system.gy) - gain * system.gy_t;
    const float scale = (system.inverse_determinant * inverse_gain) * float(kPatchOne);
    const float step_x = (system.yy * x - system.xy * y) * scale,
                step_y = (system.xx * y - system.xy * x) * scale;
    const float z =
        ((it * reciprocal_sqrt(system.tt)) * reciprocal_sqrt(ii)) * float(kOneScore) + 0.5f;
    if (!(z < float(kTooHighScore))) return out;
    const int32_t score = int32_t(std::floor(z));
    out.score = score < kOneScore ? score : kOneScore;
    if (!(std::abs(step_x) < float(kTooLongStep)) || !(std::abs(step_y) < float(kTooLongStep)))
        return out;
    out.rest = ii - gain * it;
    out.x = int32_t(std::floor(0.5f - step_x));
    out.y = int32_t(std::floor(0.5f - step_y));
    out.valid = true;
    return out;
}

// The first step, and the system for those that follow: with a gradient of the light where that
// explains enough of what is left without.
constexpr ShiftStep first_shift_step(const TemplateSums& sums, const LightFits& fits,
                                     const LiveSums& live, ShiftSystem& system) {
    system = make_shift_system(sums, fits.even);
    const ShiftStep step = shift_step(system, live);
    const ShiftSystem other = make_shift_system(sums, fits.sloped);
    const ShiftStep other_step = shift_step(other, live);
    if (!other_step.valid || (step.valid && step.rest <= kMinSlopeGain * other_step.rest))
        return step;
    system = other;
    return other_step;
}

// Catmull-Rom weights of the pixels -1, 0, 1, 2 at a fraction, 1/256 px; the weights are 1/256 and
// add up to 256.
constexpr void cubic_weights(int32_t fraction, int32_t out[4]) {
    const int64_t t = fraction;
    out[0] = int32_t((-t * t * t + 2 * 256 * t * t - 65536 * t + 65536) >> 17);
    out[1] = int32_t((3 * t * t * t - 5 * 256 * t * t + 2 * 16777216 + 65536) >> 17);
    out[3] = int32_t((t * t * t - 256 * t * t + 65536) >> 17);
    out[2] = 256 - out[0] - out[1] - out[3];
}

// How well a found patch is located, as a 2x2 matrix uu, uv, vv at level 0 in units of 1 /
// kFullPrecision^2, eigenvalues within 0 .. 1: the Fisher information of a shift estimated from n
// pixels with white noise, n z^2 / (1 - z^2) G / tt with the score z.
constexpr void information(const ShiftSystem& system, uint32_t pixels, int32_t score,
                           uint32_t level, float out[3]) {
    const float z = float(score) / float(kOneScore);
    const float noise = std::fmax(1.0f - z * z, kMinNoise);
    const float scale = kFullPrecision * kFullPrecision * float(pixels) * z * z /
                        (noise * system.tt * float(1 << (2 * level)));
    const float uu = scale * system.raw_xx, uv = scale * system.xy, vv = scale * system.raw_yy;
    const float mean = 0.5f * (uu + vv), difference = 0.5f * (uu - vv);
    const float radius = std::sqrt(difference * difference + uv * uv);
    const auto clamp = [](float value) { return std::fmin(std::fmax(value, 0.0f), 1.0f); };
    const float largest = clamp(mean + radius), smallest = clamp(mean - radius);
    const float middle = 0.5f * (largest + smallest),
                ratio = radius > 0.0f ? 0.5f * (largest - smallest) / radius : 0.0f;
    out[0] = middle + ratio * difference;
    out[1] = ratio * uv;
    out[2] = middle - ratio * difference;
}

constexpr AlignCentre centre_of(const defrec_patch& patch, uint32_t level) {
    AlignCentre centre{0, 0, patch.view, 0};
    centre.valid = to_fixed(patch.u, centre.x) && to_fixed(patch.v, centre.y);
    centre.x = to_level(centre.x, level);
    centre.y = to_level(centre.y, level);
    return centre;
}

}  // namespace defrec::align
