// Division and inverse root as the definition of stereo means them.
#pragma once
#include <bit>
#include <cstdint>

namespace defrec::reference {

inline int64_t floor_divide(int64_t a, int64_t b) {
    return a / b - (a % b != 0 && (a < 0) != (b < 0));
}

// 1 / sqrt(value) to 5e-6, from a linear guess at its logarithm and two of Newton's steps; 0 for 0.
// Only sums and products of floats, so that it is the same number everywhere.
inline float inverse_root(int64_t value) {
    if (value == 0) return 0.0f;
    const float x = float(value);
    float y = std::bit_cast<float>(0x5f375a86 - (std::bit_cast<int32_t>(x) >> 1));
    const float half = 0.5f * x;
    for (int step = 0; step < 2; ++step) y = y * (1.5f - (half * y) * y);
    return y;
}

}  // namespace defrec::reference
