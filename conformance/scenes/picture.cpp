// See picture.hpp.
#include "conformance/scenes/picture.hpp"

#include <algorithm>
#include <cmath>

namespace defrec::conformance {
namespace {

double lattice(uint64_t seed, int64_t x, int64_t y) {
    return Random(seed ^ (uint64_t(x) * 0x9e3779b97f4a7c15 + uint64_t(y) * 0xc2b2ae3d27d4eb4f))
        .within(-1, 1);
}

double smooth(double t) { return t * t * (3 - 2 * t); }

double cell_noise(uint64_t seed, double x, double y) {
    const double fx = std::floor(x), fy = std::floor(y), a = smooth(x - fx), b = smooth(y - fy);
    const auto i = int64_t(fx), j = int64_t(fy);
    const double upper = lattice(seed, i, j) * (1 - a) + lattice(seed, i + 1, j) * a;
    const double lower = lattice(seed, i, j + 1) * (1 - a) + lattice(seed, i + 1, j + 1) * a;
    return upper * (1 - b) + lower * b;
}

uint8_t to_gray(double value) { return uint8_t(std::clamp(std::floor(value + 0.5), 0.0, 255.0)); }

// Highlights: discs of 255, and 0 in the mask a pixel farther.
void add_highlights(Gray& picture, Gray& mask, Random random, int count) {
    for (int k = 0; k < count; ++k) {
        const double x0 = random.within(0, picture.width), y0 = random.within(0, picture.height),
                     radius = random.within(1, 4);
        for (uint32_t y = 0; y < picture.height; ++y)
            for (uint32_t x = 0; x < picture.width; ++x) {
                const double d = std::hypot(x - x0, y - y0);
                if (d <= radius) picture.at(x, y) = 255;
                if (d <= radius + 1.5) mask.at(x, y) = 0;
            }
    }
}

}  // namespace

double Texture::at(double x, double y) const {
    double sum = 120, amplitude = 45;
    for (const double cell : {24.0, 12.0, 6.0, 3.0}) {
        sum += amplitude * cell_noise(seed_ + uint64_t(cell), x / cell, y / cell);
        amplitude *= 0.75;
    }
    return sum;
}

Gray flat_picture(uint32_t width, uint32_t height, uint8_t value) {
    return {width, height, std::vector<uint8_t>(size_t(width) * height, value)};
}

Gray random_picture(uint32_t width, uint32_t height, uint64_t seed) {
    Gray picture = flat_picture(width, height, 0);
    Random random(seed);
    for (uint8_t& pixel : picture.pixels) pixel = uint8_t(random.next() >> 40);
    return picture;
}

Gray texture_picture(uint32_t width, uint32_t height, uint64_t seed, double dx, double dy,
                     double noise) {
    Gray picture = flat_picture(width, height, 0);
    const Texture texture(seed);
    Random random(seed + 1);
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x)
            picture.at(x, y) = to_gray(texture.at(x - dx, y - dy) + noise * random.normal());
    return picture;
}

Gray holes_mask(uint32_t width, uint32_t height, uint64_t seed, uint32_t count, uint32_t largest) {
    Gray mask = flat_picture(width, height, 255);
    Random random(seed);
    for (uint32_t k = 0; k < count; ++k) {
        const uint32_t x0 = random.below(width), y0 = random.below(height),
                       side = 1 + random.below(largest);
        for (uint32_t y = y0; y < std::min(height, y0 + side); ++y)
            for (uint32_t x = x0; x < std::min(width, x0 + side); ++x) mask.at(x, y) = 0;
    }
    return mask;
}

StereoPair stereo_pair(uint32_t width, uint32_t height, uint64_t seed, double disparity) {
    const Texture surface(seed), strip(seed + 100);
    const double strip_from = 0.35 * width, strip_to = 0.5 * width, near = disparity + 6;
    const auto wave = [&](double x, double y) {
        return disparity + 2.5 * std::sin(x / 17.0) + 1.5 * std::cos(y / 13.0) + 0.02 * y;
    };
    const auto in_strip = [&](double x, double y) {
        const double slanted = x + 0.15 * y;
        return slanted >= strip_from && slanted <= strip_to;
    };
    StereoPair pair{flat_picture(width, height, 0), flat_picture(width, height, 0),
                    flat_picture(width, height, 255), flat_picture(width, height, 255)};
    Random random(seed + 2);
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            const double left = in_strip(x, y) ? strip.at(x, y) : surface.at(x, y);
            double at = x + disparity;
            for (int i = 0; i < 8; ++i)
                at = x + wave(at, y);  // the surface point that the right view sees
            const double right = in_strip(x + near, y) ? strip.at(x + near, y) : surface.at(at, y);
            pair.left.at(x, y) = to_gray(left + 1.5 * random.normal());
            pair.right.at(x, y) = to_gray(0.95 * right + 4 + 1.5 * random.normal());
        }
    const int highlights = int(width * height / 2500);
    add_highlights(pair.left, pair.left_mask, Random(seed + 3), highlights);
    add_highlights(pair.right, pair.right_mask, Random(seed + 4), highlights);
    return pair;
}

}  // namespace defrec::conformance
