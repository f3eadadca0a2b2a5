// The formulas of backends/definition/align_math.hpp that the search and the refinement need. Exact
// but for `information`: every operation on floats is precise, and there is no division and no
// square root. Needs backends/stages/align.hpp.

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

float reciprocal(float x) {
    precise const float root = reciprocal_sqrt(x);
    precise const float result = root * root;
    return result;
}

float covariance(int a, int b, int ab, float inverse_n) {
    precise const float result = float(ab) - (float(a) * float(b)) * inverse_n;
    return result;
}

// Sums over a patch's usable pixels: x and y the offset from its centre, t the template, gx and gy
// its gradient, i the live image.
struct TemplateSums {
    int n, x, y, xx, xy, yy, t, gx, gy, xt, yt, xgx, ygx, xgy, ygy, tt, gxx, gxy, gyy, gxt, gyt;
};
struct LiveSums {
    int i, xi, yi, ii, it, igx, igy;
};

// An image's sum over the patch, and its moments along the two axes of LightFit.
struct LightMoments {
    float sum, x, y;
};

// What differences of the light explain of an image: an offset and, with a gradient, a plane.
struct LightFit {
    float inverse_n, x, y, skew, inverse_xx, inverse_yy;
};
LightMoments moments(LightFit light, int a, int xa, int ya) {
    precise const float sum = float(a);
    precise const float x = float(xa) - (light.x * sum) * light.inverse_n;
    precise const float y = (float(ya) - (light.y * sum) * light.inverse_n) - light.skew * x;
    return LightMoments(sum, x, y);
}
float rest(LightFit light, int ab, LightMoments a, LightMoments b) {
    precise const float result =
        ((float(ab) - (a.sum * b.sum) * light.inverse_n) - (a.x * b.x) * light.inverse_xx) -
        (a.y * b.y) * light.inverse_yy;
    return result;
}
LightFit make_light_fit(TemplateSums s, float inverse_n, bool has_gradient) {
    if (!has_gradient) return LightFit(inverse_n, 0.0, 0.0, 0.0, 0.0, 0.0);
    precise const float x = float(s.x), y = float(s.y);
    precise const float xx = float(s.xx) - (x * x) * inverse_n;
    precise const float xy = float(s.xy) - (x * y) * inverse_n;
    precise const float yy = float(s.yy) - (y * y) * inverse_n;
    precise const float inverse_xx = reciprocal(xx), skew = xy * inverse_xx;
    precise const float left = yy - skew * xy;
    return LightFit(inverse_n, x, y, skew, inverse_xx, reciprocal(left));
}

// The normal equations of the shift, gain and light eliminated.
struct ShiftSystem {
    LightFit light;
    LightMoments t, gx, gy;
    float inverse_tt, tt, gx_t, gy_t;
    float xx, xy, yy;  // damped
    float inverse_determinant;
    float raw_xx, raw_yy;  // not damped
    bool solvable;
};
ShiftSystem make_shift_system(TemplateSums s, LightFit light) {
    precise ShiftSystem o;
    o.light = light;
    o.t = moments(light, s.t, s.xt, s.yt);
    o.gx = moments(light, s.gx, s.xgx, s.ygx);
    o.gy = moments(light, s.gy, s.xgy, s.ygy);
    o.tt = rest(light, s.tt, o.t, o.t);
    o.inverse_tt = reciprocal(o.tt);
    o.gx_t = rest(light, s.gxt, o.gx, o.t);
    o.gy_t = rest(light, s.gyt, o.gy, o.t);
    o.raw_xx = rest(light, s.gxx, o.gx, o.gx) - (o.gx_t * o.gx_t) * o.inverse_tt;
    o.raw_yy = rest(light, s.gyy, o.gy, o.gy) - (o.gy_t * o.gy_t) * o.inverse_tt;
    o.xy = rest(light, s.gxy, o.gx, o.gy) - (o.gx_t * o.gy_t) * o.inverse_tt;
    precise const float damping = (o.raw_xx + o.raw_yy) * kShiftDamping;
    o.xx = o.raw_xx + damping;
    o.yy = o.raw_yy + damping;
    precise const float determinant = o.xx * o.yy - o.xy * o.xy;
    o.inverse_determinant = reciprocal(determinant);
    o.solvable = o.tt >= 1.0 && determinant >= 1.0 && damping > 0.0;
    return o;
}

// A Gauss-Newton step, 1/256 px, and the ZNCC before it, 1/65536; valid where the images correlate
// and the step is short.
struct ShiftStep {
    ivec2 by;
    int score;
    float rest;  // of the live image's squares that the template does not explain
    bool valid;
};
const ShiftStep kNoStep = ShiftStep(ivec2(0), 0, 0.0, false);
ShiftStep shift_step(ShiftSystem system, LiveSums s) {
    if (!system.solvable) return kNoStep;
    const LightMoments i = moments(system.light, s.i, s.xi, s.yi);
    const float ii = rest(system.light, s.ii, i, i), it = rest(system.light, s.it, i, system.t);
    if (!(ii >= 1.0 && it >= 1.0)) return kNoStep;
    precise const float gain = it * system.inverse_tt;
    precise const float inverse_gain = system.tt * reciprocal(it);
    precise const float x = rest(system.light, s.igx, i, system.gx) - gain * system.gx_t;
    precise const float y = rest(system.light, s.igy, i, system.gy) - gain * system.gy_t;
    precise const float scale = (system.inverse_determinant * inverse_gain) * float(kPatchOne);
    precise const float step_x = (system.yy * x - system.xy * y) * scale;
    precise const float step_y = (system.xx * y - system.xy * x) * scale;
    precise const float z =
        ((it * reciprocal_sqrt(system.tt)) * reciprocal_sqrt(ii)) * float(kOneScore) + 0.5;
    if (!(z < float(kTooHighScore))) return kNoStep;
    if (!(abs(step_x) < float(kTooLongStep) && abs(step_y) < float(kTooLongStep))) return kNoStep;
    precise const float unexplained = ii - gain * it;
    precise const float to_x = 0.5 - step_x, to_y = 0.5 - step_y;
    return ShiftStep(ivec2(floor(to_x), floor(to_y)), min(int(floor(z)), kOneScore), unexplained,
                     true);
}

// The first step, and the system for those that follow: with a gradient of the light where that
// explains enough of what is left without.
ShiftStep first_shift_step(TemplateSums sums, float inverse_n, LiveSums live,
                           out ShiftSystem system) {
    system = make_shift_system(sums, make_light_fit(sums, inverse_n, false));
    const ShiftStep first = shift_step(system, live);
    const ShiftSystem other = make_shift_system(sums, make_light_fit(sums, inverse_n, true));
    const ShiftStep other_first = shift_step(other, live);
    precise const float limit = kMinSlopeGain * other_first.rest;
    if (!other_first.valid || (first.valid && first.rest <= limit)) return first;
    system = other;
    return other_first;
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
    const float z = float(score) / float(kOneScore);
    const float noise = max(1.0 - z * z, kMinNoise);
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
