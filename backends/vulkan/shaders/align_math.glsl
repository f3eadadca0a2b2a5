// The formulas of backends/shared/align_math.hpp that the search and the refinement need. Exact but
// for `information`: every operation on floats is precise, and there is no division and no square
// root.

const int kUnscored = -0x7fffffff - 1;
const float kOneScore = 65536.0;
const int kMaxMatrix = 4 * 65536;
const int kDistancePenalty = 32;
const int kShiftSteps = 4;
const float kFullPrecision = 0.1;

int to_level(int position, int level) {
    return ((position + 128 + ((1 << level) >> 1)) >> level) - 128;
}
int from_level(int position, int level) { return (position + 128) * (1 << level) - 128; }

float reciprocal_sqrt(float x) {
    precise const float half_x = 0.5 * x;
    precise float y = uintBitsToFloat(0x5f3759dfu - (floatBitsToUint(x) >> 1));
    for (int i = 0; i < 3; ++i) y = y * (1.5 - (half_x * y) * y);
    return y;
}

float covariance(int a, int b, int ab, float inverse_n) {
    precise const float result = float(ab) - (float(a) * float(b)) * inverse_n;
    return result;
}

// Sums over a patch's pixels: t the template, gx and gy its gradient, i the live image.
struct TemplateSums {
    int n, t, tt, gx, gy, gxx, gxy, gyy, gxt, gyt;
};
struct LiveSums {
    int i, ii, it, igx, igy;
};

// The normal equations of the shift, gain and offset eliminated.
struct ShiftSystem {
    float inverse_n, inverse_tt, tt, gx_t, gy_t;
    float xx, xy, yy;  // damped
    float inverse_determinant;
    float raw_xx, raw_yy;  // not damped
    bool solvable;
};
ShiftSystem make_shift_system(TemplateSums s, float inverse_n) {
    precise ShiftSystem o;
    o.inverse_n = inverse_n;
    o.tt = covariance(s.t, s.t, s.tt, inverse_n);
    precise const float root = reciprocal_sqrt(o.tt);
    o.inverse_tt = root * root;
    o.gx_t = covariance(s.gx, s.t, s.gxt, inverse_n);
    o.gy_t = covariance(s.gy, s.t, s.gyt, inverse_n);
    o.raw_xx = covariance(s.gx, s.gx, s.gxx, inverse_n) - (o.gx_t * o.gx_t) * o.inverse_tt;
    o.raw_yy = covariance(s.gy, s.gy, s.gyy, inverse_n) - (o.gy_t * o.gy_t) * o.inverse_tt;
    o.xy = covariance(s.gx, s.gy, s.gxy, inverse_n) - (o.gx_t * o.gy_t) * o.inverse_tt;
    precise const float damping = (o.raw_xx + o.raw_yy) * (1.0 / 1024.0);
    o.xx = o.raw_xx + damping;
    o.yy = o.raw_yy + damping;
    precise const float determinant = o.xx * o.yy - o.xy * o.xy;
    precise const float root_determinant = reciprocal_sqrt(determinant);
    o.inverse_determinant = root_determinant * root_determinant;
    o.solvable = o.tt >= 1.0 && determinant >= 1.0 && damping > 0.0;
    return o;
}

// One Gauss-Newton step, 1/256 px, and the ZNCC before it, 1/65536; false where the images do not
// correlate.
bool shift_step(ShiftSystem system, TemplateSums t, LiveSums s, out ivec2 by, out int score) {
    by = ivec2(0);
    score = 0;
    const float ii = covariance(s.i, s.i, s.ii, system.inverse_n),
                it = covariance(s.i, t.t, s.it, system.inverse_n);
    if (!(ii >= 1.0 && it >= 1.0)) return false;
    precise const float gain = it * system.inverse_tt;
    precise const float root = reciprocal_sqrt(it);
    precise const float inverse_gain = system.tt * (root * root);
    precise const float x = covariance(s.i, t.gx, s.igx, system.inverse_n) - gain * system.gx_t;
    precise const float y = covariance(s.i, t.gy, s.igy, system.inverse_n) - gain * system.gy_t;
    precise const float scale = (system.inverse_determinant * inverse_gain) * 256.0;
    precise const float step_x = (system.yy * x - system.xy * y) * scale;
    precise const float step_y = (system.xx * y - system.xy * x) * scale;
    precise const float z =
        ((it * reciprocal_sqrt(system.tt)) * reciprocal_sqrt(ii)) * kOneScore + 0.5;
    score = int(floor(z));
    if (!(abs(step_x) < 512.0 && abs(step_y) < 512.0)) return false;
    precise const float to_x = 0.5 - step_x, to_y = 0.5 - step_y;
    by = ivec2(floor(to_x), floor(to_y));
    return true;
}

// Catmull-Rom weights of the pixels -1, 0, 1, 2 at a fraction, 1/256 px; the weights are 1/256.
ivec4 cubic_weights(int t) {
    const int t2 = t * t, t3 = t2 * t;
    const int before = (-t3 + 512 * t2 - 65536 * t + 65536) >> 17;
    const int at = (3 * t3 - 1280 * t2 + 2 * 16777216 + 65536) >> 17;
    const int last = (t3 - 256 * t2 + 65536) >> 17;
    return ivec4(before, at, 256 - before - at - last, last);
}

// uu, uv, vv.
float[3] information(ShiftSystem system, int pixels, int score, int level) {
    const float z = float(score) / kOneScore;
    const float noise = max(1.0 - z * z, 0.01);
    const float scale = kFullPrecision * kFullPrecision * float(pixels) * z * z /
                        (noise * system.tt * float(1 << (2 * level)));
    const float uu = scale * system.raw_xx, uv = scale * system.xy, vv = scale * system.raw_yy;
    const float mean = 0.5 * (uu + vv), difference = 0.5 * (uu - vv);
    const float radius = sqrt(difference * difference + uv * uv);
    const float largest = clamp(mean + radius, 0.0, 1.0), smallest = clamp(mean - radius, 0.0, 1.0);
    const float middle = 0.5 * (largest + smallest),
                ratio = radius > 0.0 ? 0.5 * (largest - smallest) / radius : 0.0;
    return float[3](middle + ratio * difference, ratio * uv, middle - ratio * difference);
}
