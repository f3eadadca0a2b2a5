// Integer root and division as the definition of stereo means them.
#pragma once
#include <cmath>
#include <cstdint>

namespace defrec::reference {

inline int64_t floor_divide(int64_t a, int64_t b) { return a / b - (a % b != 0 && (a < 0) != (b < 0)); }

inline int64_t floor_root(int64_t value) {
    int64_t root = int64_t(std::sqrt(double(value)));
    while (root * root > value) --root;
    while ((root + 1) * (root + 1) <= value) ++root;
    return root;
}

// floor(2^30 / floor(sqrt(value))) as a float, 0 for 0.
inline float inverse_root(int64_t value) {
    const int64_t root = floor_root(value);
    return root == 0 ? 0.0f : float((int64_t{1} << 30) / root);
}

}  // namespace defrec::reference
