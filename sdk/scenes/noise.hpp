// Counter-based random numbers and gradient noise: functions of their arguments alone, so that a
// picture does not depend on the order in which threads paint it.
#pragma once

#include <cstdint>

namespace defrec::cli {

/// Scrambles 64 bits (the finaliser of SplitMix64, Steele et al. 2014).
inline std::uint64_t scramble(std::uint64_t x) {
    x += 0x9E3779B97F4A7C15ull;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
    return x ^ (x >> 31);
}

/// A stream of numbers for building a scene; the same seed gives the same stream.
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(scramble(seed)) {}

    /// Uniform in [low, high).
    double uniform(double low, double high) {
        state_ = scramble(state_);
        return low + (high - low) * (static_cast<double>(state_ >> 11) * 0x1.0p-53);
    }

  private:
    std::uint64_t state_;
};

inline std::uint32_t lattice_hash(std::int32_t x, std::int32_t y, std::uint32_t seed) {
    std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8DA6B343u ^
                      static_cast<std::uint32_t>(y) * 0xD8163841u ^ seed;
    h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12)) * 0x297A2D39u;
    return h ^ (h >> 15);
}

/// One of 16 directions.
struct LatticeGradient {
    explicit LatticeGradient(std::uint32_t hash) {
        constexpr float kCos[16] = {1.0f,     0.9239f,  0.7071f, 0.3827f,  0.0f,     -0.3827f,
                                    -0.7071f, -0.9239f, -1.0f,   -0.9239f, -0.7071f, -0.3827f,
                                    -0.0f,    0.3827f,  0.7071f, 0.9239f};
        const std::uint32_t i = hash >> 28;
        x = kCos[i];
        y = kCos[(i + 12) & 15];
    }
    /// Times the offset from the lattice point.
    float at(float dx, float dy) const { return x * dx + y * dy; }

    float x, y;
};

/// Those round a lattice cell.
struct LatticeCell {
    LatticeCell(std::int32_t ix, std::int32_t iy, std::uint32_t seed)
        : a(lattice_hash(ix, iy, seed)),
          b(lattice_hash(ix + 1, iy, seed)),
          c(lattice_hash(ix, iy + 1, seed)),
          d(lattice_hash(ix + 1, iy + 1, seed)) {}

    /// Noise at (fx, fy) in the cell; u and v are faded(fx) and faded(fy).
    float noise(float fx, float fy, float u, float v) const {
        const float na = a.at(fx, fy);
        const float nb = b.at(fx - 1.0f, fy);
        const float nc = c.at(fx, fy - 1.0f);
        const float nd = d.at(fx - 1.0f, fy - 1.0f);
        const float top = na + u * (nb - na);
        const float bottom = nc + u * (nd - nc);
        return 1.4f * (top + v * (bottom - top));
    }

    LatticeGradient a, b, c, d;
};

inline float faded(float f) { return f * f * f * (f * (f * 6.0f - 15.0f) + 10.0f); }

/// std::floor is a call into the C library on the baseline instruction set.
inline std::int32_t floor_to_int(float x) {
    const auto truncated = static_cast<std::int32_t>(x);
    return truncated - (static_cast<float>(truncated) > x ? 1 : 0);
}

/// Gradient noise (Perlin 2002, quintic fade) with a lattice of 1; about -1..1, mean 0, standard
/// deviation about 0.35.
inline float gradient_noise(float x, float y, std::uint32_t seed) {
    const std::int32_t ix = floor_to_int(x);
    const std::int32_t iy = floor_to_int(y);
    const float fx = x - static_cast<float>(ix);
    const float fy = y - static_cast<float>(iy);
    return LatticeCell(ix, iy, seed).noise(fx, fy, faded(fx), faded(fy));
}

inline float smooth_step(float low, float high, float x) {
    float t = (x - low) / (high - low);
    t = t < 0.0f ? 0.0f : (t > 1.0f ? 1.0f : t);
    return t * t * (3.0f - 2.0f * t);
}

}  // namespace defrec::cli
