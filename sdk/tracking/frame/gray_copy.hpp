// Copies pixels as gray values, of which stage rectify makes the same image as of the colours.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec {

// Bytes before colours are copied that they are fetched: a processor by itself does not look as far
// ahead.
constexpr size_t kFetchAhead = 4096;

// from: pixels of a DEFREC_FORMAT_*, without gaps; to: as many gray values. streams: past the
// caches, for a device (streaming_copy.hpp). ahead: bytes from each pixel to one that is copied
// kFetchAhead later. There may be none: nothing is read there.
void copy_gray(uint32_t format, const uint8_t* from, size_t pixels, uint8_t* to, bool streams,
               size_t ahead = kFetchAhead);

}  // namespace defrec
