// Synthetic gray images of the cases: tissue-like texture, stereo pairs of a wavy surface, and what
// is none of that.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "conformance/worker/random.hpp"

namespace defrec::conformance {

struct Gray {
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> pixels;  // without gaps
    uint8_t& at(uint32_t x, uint32_t y) { return pixels[size_t(y) * width + x]; }
    uint8_t at(uint32_t x, uint32_t y) const { return pixels[size_t(y) * width + x]; }
};

// Smooth noise of cells of 24 to 3 px, at any real position; the seed makes another.
class Texture {
  public:
    explicit Texture(uint64_t seed) : seed_(seed) {}
    double at(double x, double y) const;  // about 120, standard deviation about 25

  private:
    uint64_t seed_;
};

Gray flat_picture(uint32_t width, uint32_t height, uint8_t value);
Gray random_picture(uint32_t width, uint32_t height, uint64_t seed);
// The texture, moved by (dx, dy), with noise of that standard deviation.
Gray texture_picture(uint32_t width, uint32_t height, uint64_t seed, double dx = 0, double dy = 0,
                     double noise = 1.5);
// 255, but 0 in blocks of up to `largest` px here and there.
Gray holes_mask(uint32_t width, uint32_t height, uint64_t seed, uint32_t count, uint32_t largest);

// A wavy surface with a nearer strip across, seen by two views, with highlights that are elsewhere
// in the two and noise. Masks: 0 at highlights and a pixel round them.
struct StereoPair {
    Gray left, right, left_mask, right_mask;
};
StereoPair stereo_pair(uint32_t width, uint32_t height, uint64_t seed, double disparity = 12);

}  // namespace defrec::conformance
