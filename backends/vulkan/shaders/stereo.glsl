// What the shaders of stage stereo share. The sections they name are those of
// docs/stages/stereo.md.
#include "backends/stages/stereo.hpp"
#include "stereo_push.h"
layout(push_constant) uniform Push {
    StereoConstants push;
    StereoGiven given;
};

// 0 for 0, else about 1 / sqrt(value).
vec4 inverse_roots(ivec4 value) {
    precise const vec4 x = vec4(value);
    precise const vec4 half_x = 0.5 * x;
    precise vec4 y = intBitsToFloat(0x5f375a86 - (floatBitsToInt(x) >> 1));
    for (int step = 0; step < 2; ++step) {
        precise const vec4 a = half_x * y;
        precise const vec4 b = a * y;
        precise const vec4 c = 1.5 - b;
        y = y * c;
    }
    return mix(vec4(0.0), y, greaterThan(value, ivec4(0)));
}
float inverse_root(int value) { return inverse_roots(ivec4(value)).x; }

// b > 0.
int floor_divide(int a, int b) {
    const int q = a / b;
    return a - q * b < 0 ? q - 1 : q;
}

// 256 variance >= (push.texture n)^2
bool has_texture(int variance, int n) {
    const int64_t minimum = int64_t(push.texture) * int64_t(n);
    return int64_t(256) * int64_t(variance) >= minimum * minimum;
}
