// A textured plane before two rectified cameras, that moves.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::test {

inline constexpr int kWidth = 320, kHeight = 240;
inline constexpr double kFocal = 340, kBaseline = 5, kDepth = 80, kSlope = 0.15;

// The rig of the two cameras.
inline defrec_rig_desc scene_rig() {
    defrec_rig_desc desc;
    DEFREC_INIT(&desc);
    desc.width = kWidth;
    desc.height = kHeight;
    desc.left = {kFocal, kFocal, kWidth / 2, kHeight / 2, {}, 0, 0};
    desc.right = desc.left;
    desc.rotation[0] = desc.rotation[4] = desc.rotation[8] = 1;
    desc.translation[0] = -kBaseline;
    return desc;
}

inline double hash_noise(int64_t x, int64_t y, uint64_t octave) {
    uint64_t h = static_cast<uint64_t>(x) * 0x9e3779b97f4a7c15u ^
                 static_cast<uint64_t>(y) * 0xc2b2ae3d27d4eb4fu ^ octave * 0x165667b19e3779f9u;
    h ^= h >> 29;
    h *= 0xbf58476d1ce4e5b9u;
    h ^= h >> 32;
    return static_cast<double>(h & 0xffff) / 65535.0 - 0.5;
}

inline double smooth_noise(double x, double y, uint64_t octave) {
    const double fx = std::floor(x), fy = std::floor(y);
    const auto ix = static_cast<int64_t>(fx), iy = static_cast<int64_t>(fy);
    const auto ease = [](double t) { return t * t * (3 - 2 * t); };
    const double a = ease(x - fx), b = ease(y - fy);
    return (1 - b) * ((1 - a) * hash_noise(ix, iy, octave) + a * hash_noise(ix + 1, iy, octave)) +
           b * ((1 - a) * hash_noise(ix, iy + 1, octave) + a * hash_noise(ix + 1, iy + 1, octave));
}

// Gray value of the material at X, Y mm.
inline double texture(double x, double y) {
    double value = 0;
    for (uint64_t octave = 0; octave < 4; ++octave) {
        const double scale = 0.35 * static_cast<double>(1u << octave);
        value += smooth_noise(x * scale, y * scale, octave) * 70 /
                 static_cast<double>(1u << (octave / 2));
    }
    return std::clamp(125 + value, 0.0, 255.0);
}

struct Pair {
    std::vector<uint8_t> left = std::vector<uint8_t>(kWidth * kHeight), right = left;
};

// The plane z = kDepth + kSlope x, its material moved by (dx, dy) mm along x and y. noise: gray
// levels.
inline Pair render(double dx, double dy, double noise = 0, uint64_t seed = 0) {
    Pair pair;
    for (int view = 0; view < 2; ++view) {
        const double origin = view * kBaseline;
        std::vector<uint8_t>& image = view == 0 ? pair.left : pair.right;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const double u = (x - kWidth / 2) / kFocal, v = (y - kHeight / 2) / kFocal;
                const double z = (kDepth + kSlope * origin) / (1 - kSlope * u);
                const double gray = texture(origin + u * z - dx, v * z - dy) +
                                    2 * noise * hash_noise(x + 1000 * view, y, seed + 77);
                image[static_cast<size_t>(y * kWidth + x)] =
                    static_cast<uint8_t>(std::lround(std::clamp(gray, 0.0, 255.0)));
            }
    }
    return pair;
}

}  // namespace defrec::test
