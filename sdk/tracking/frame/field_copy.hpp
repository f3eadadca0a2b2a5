// Makes a whole picture of one field of an interlaced image.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec {

// Pixels of a DEFREC_FORMAT_*.
struct RawImage {
    uint32_t format;
    const uint8_t* pixels;
    size_t stride;  // bytes from row to row
    size_t width;   // px
    size_t height;
};
// Rows from the first up to the one before the last.
struct RowSpan {
    size_t first, last;
};

// Gray values of some rows, tight: the field's own, and between them the mean of those above and
// below. No row of the other field is read. to: of the first row. streams: past the caches, for a
// device (streaming_copy.hpp).
void copy_field(const RawImage& image, bool is_bottom, RowSpan rows, uint8_t* to, bool streams);

}  // namespace defrec
