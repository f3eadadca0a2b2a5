// The fields of interlaced images, and their order in time.
#pragma once

#include <cstdint>

namespace defrec::cli {

// kAuto: as the images turn out to be.
enum class FieldOrder { kProgressive, kTopFirst, kBottomFirst, kAuto };

constexpr int kFieldsOfImage = 2;

// kAuto: not known yet, false.
inline bool is_interlaced(FieldOrder order) {
    return order == FieldOrder::kTopFirst || order == FieldOrder::kBottomFirst;
}
inline int frames_of_image(FieldOrder order) { return is_interlaced(order) ? kFieldsOfImage : 1; }

// Whether a field has the rows 1, 3, 5 ... of its image. number: in the order of their times, two
// for each image.
inline bool is_bottom_field(FieldOrder order, std::int64_t number) {
    const bool is_later = number % kFieldsOfImage != 0;
    return is_later == (order == FieldOrder::kTopFirst);
}

}  // namespace defrec::cli
