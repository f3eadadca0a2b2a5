// How fine the texture is that stands out from an image's noise.
#pragma once
#include <cstdint>

#include "sdk/template/decisions.hpp"

namespace defrec {

// The finest level of a gray image's pyramid, 0 to 2, on which enough windows show the same in a
// second image with other noise: what is expected of their ZNCC is 1 less the share of the noise in
// their variance. The noise is that of the image's second differences across and down (Immerkaer,
// Fast Noise Variance Estimation, 1996), by their median; more than a sensor has is texture, on
// level 0. What is dark or saturated says nothing of either; 0 where few windows are left. gray:
// width * height, without gaps.
uint32_t texture_level(const uint8_t* gray, uint32_t width, uint32_t height);

// Noise hides all texture but what is coarse: so it does features, and what stereo compares.
constexpr bool is_faint(uint32_t texture_level) {
    return texture_level >= decisions::TextureLevel::kFaint;
}

}  // namespace defrec
