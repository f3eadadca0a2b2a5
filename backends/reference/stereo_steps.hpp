// The sub-stages of stereo, each a function from whole images, or the field of their samples, to
// such. docs/stages/stereo.md, section by section.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "backends/stages/stereo.hpp"

namespace defrec::reference {

// A picture of T, row by row without gaps.
template <class T>
struct Picture {
    Picture(int w, int h, T value = T())
        : width(w), height(h), pixels(std::size_t(w) * std::size_t(h), value) {}
    T& operator()(int x, int y) {
        return pixels[std::size_t(y) * std::size_t(width) + std::size_t(x)];
    }
    const T& operator()(int x, int y) const {
        return pixels[std::size_t(y) * std::size_t(width) + std::size_t(x)];
    }
    // The nearest pixel of the picture.
    const T& clamped(int x, int y) const {
        return (*this)(x < 0       ? 0
                       : x < width ? x
                                   : width - 1,
                       y < 0        ? 0
                       : y < height ? y
                                    : height - 1);
    }
    bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }

    int width, height;
    std::vector<T> pixels;
};
using Gray = Picture<uint8_t>;
using Mask = Picture<uint8_t>;         // nonzero: usable
using Disparities = Picture<int16_t>;  // 1/16 px of their own resolution

Gray inpaint(const Gray& gray, const Mask& mask);  // 1
Gray halve(const Gray& gray);                      // 2
Mask halve_mask(const Mask& mask);

struct WindowStatistics {  // of values minus 128 in windows wholly inside; 0 where there is none
    Picture<int32_t> sum, variance;
    Picture<float> inverse;
};
WindowStatistics statistics(const Gray& gray, int radius);

struct SearchResult {
    Picture<int32_t> left;    // of samples: the winners' keys, 0: none
    Picture<int32_t> right;   // of all pixels in the samples' rows, likewise
    Picture<int32_t> second;  // the best key of a group that is not next to the left winner's
};
SearchResult search(const Gray& left, const Gray& right, const WindowStatistics& left_stats,
                    const WindowStatistics& right_stats, const StereoConstants& c);  // 3

Disparities check(const SearchResult& found, const WindowStatistics& left_stats,
                  const Mask& left_mask, const Mask& right_mask, const StereoConstants& c);  // 4
Disparities supported(const Disparities& disparities, const StereoConstants& c);             // 5
Disparities smooth(const Disparities& disparities, int radius, int range);  // 6, 12
Disparities fill_all(const Disparities& disparities);                       // 6
bool is_empty(const Disparities& disparities);
Picture<uint8_t> standing(const Disparities& supported, const Disparities& dense,
                          const StereoConstants& c);  // 7

struct Refinement {
    Disparities disparity;      // moved, or as it was without a peak
    Picture<int16_t> score;     // the best of the three coefficients, 1/4096
    Mask peak;                  // a maximum within one pixel
    Picture<int64_t> variance;  // n^2 times the variance of the left window
    Picture<int32_t> count;     // n
};
Refinement refine(const Gray& left, const Gray& right, const Disparities& hypothesis,
                  int radius);                                                      // 8
Disparities between_samples(const Disparities& samples, int width, int height);     // 8
Disparities hypothesis_of(const Disparities& half_samples, int width, int height);  // 9

struct Evidence {  // of samples
    Disparities disparity;
    Picture<uint8_t> confidence;
};
Evidence classify(const Refinement& refined, const Disparities& hypothesis,
                  const Picture<uint8_t>& standing_half, const Mask& left_mask,
                  const Mask& right_mask, const StereoConstants& c);                           // 10
void drop_speckles(Evidence& evidence, const StereoConstants& c);                              // 10
void fill_small(Evidence& evidence, const Disparities& hypothesis, const StereoConstants& c);  // 11
Evidence at_all_pixels(const Evidence& samples, const StereoConstants& c);                     // 13

}  // namespace defrec::reference
