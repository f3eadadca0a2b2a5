// Copies pixels as gray values, of which stage rectify makes the same image as of the colours.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec {

// from: pixels of a DEFREC_FORMAT_*, without gaps; to: as many gray values. streams: past the
// caches, for a device (streaming_copy.hpp).
void copy_gray(uint32_t format, const uint8_t* from, size_t pixels, uint8_t* to, bool streams);

}  // namespace defrec
