// What the shaders of stage stereo share. The sections they name are those of
// docs/stages/stereo.md.
//
// Shaders read images in words. A column word (x, q) has the pixels (x, 4 q) to (x, 4 q + 3) minus
// 128, 0 outside the image. Row word k of a row, of 64 bits, has the pixels 4 (k - 1) to 4 (k - 1)
// + 7, read clamped: any four pixels that follow one another are in one of them.
#include "backends/stages/stereo.hpp"
#include "stereo_push.h"
layout(push_constant) uniform Push {
    StereoConstants push;
    StereoGiven given;
};

bool is_given(int which) { return (given.outputs >> which & 1) != 0; }

int words_of(int pixels) { return (pixels + 3) / 4; }
int row_words_of(int width) { return words_of(width) + 2; }

// Pixel k of a column word.
int pixel(int word, int k) { return (word << (24 - 8 * k)) >> 24; }

// 0 for 0, else about 1 / sqrt(value).
float inverse_root(int value) {
    precise const float x = float(value);
    precise const float half_x = 0.5 * x;
    precise float y = intBitsToFloat(0x5f375a86 - (floatBitsToInt(x) >> 1));
    [[unroll]] for (int step = 0; step < 2; ++step) {
        precise const float a = half_x * y;
        precise const float b = a * y;
        precise const float c = 1.5 - b;
        y = y * c;
    }
    return value > 0 ? y : 0.0;
}

// b > 0.
int floor_divide(int a, int b) {
    const int q = a / b;
    return a - q * b < 0 ? q - 1 : q;
}

// kTextureOne2 variance >= (push.texture n)^2
bool has_texture(int variance, int n) {
    const int64_t minimum = int64_t(push.texture) * int64_t(n);
    return int64_t(kTextureOne2) * int64_t(variance) >= minimum * minimum;
}

// The candidate of a winner that has no rival: 1 + the index of its disparity; else 0.
int candidate_of(int key, int second) {
    const float score = intBitsToFloat(key & ~255);
    precise const float lead = score - intBitsToFloat(second & ~255);
    return key != 0 && score >= push.min_score && lead >= push.min_lead ? 1 + (key & 255) : 0;
}
