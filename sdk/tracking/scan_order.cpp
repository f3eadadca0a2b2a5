// See scan_order.hpp.
#include "sdk/tracking/scan_order.hpp"

#include <algorithm>
#include <array>

#include "sdk/contract/pixel_format.hpp"
#include "sdk/tracking/decisions/images.hpp"
#include "sdk/tracking/frame/gray_copy.hpp"

namespace defrec {
namespace {

using decisions::ScanOrder;

// Columns that are compared at a time: threads of callers may have small stacks.
constexpr uint32_t kColumns = 1024;
using Row = std::array<uint8_t, kColumns>;

// A row of an image with those beside it, in some columns.
struct Rows {
    Row above, middle, below;
};

struct Columns {
    uint32_t first, count;
};

void read_rows(const defrec_image& image, uint32_t y, Columns columns, Rows& rows) {
    Row* const to[] = {&rows.above, &rows.middle, &rows.below};
    for (uint32_t i = 0; i < 3; ++i)
        copy_gray(image.format,
                  static_cast<const uint8_t*>(image.pixels) + (y - 1 + i) * image.stride +
                      size_t{columns.first} * bytes_per_pixel(image.format),
                  columns.count, to[i]->data(), false);
}

// Squared second differences of a row among rows of the other field.
double unlikeness(const Row& middle, const Rows& other, uint32_t count) {
    uint64_t sum = 0;
    for (uint32_t x = 0; x < count; ++x) {
        const int difference = 2 * middle[x] - other.above[x] - other.below[x];
        sum += static_cast<uint32_t>(difference * difference);
    }
    return static_cast<double>(sum);
}

// Sums over pictures woven of the images' own fields, of the later top and the earlier bottom
// field, and of the earlier top and the later bottom field.
struct Unlikeness {
    double own = 0, later_top = 0, later_bottom = 0;
};

void compare_rows(const defrec_image& earlier, const defrec_image& later, uint32_t y,
                  Unlikeness& sums) {
    Rows before, after;
    for (uint32_t x = 0; x < earlier.width; x += kColumns) {
        const Columns columns{x, std::min(kColumns, earlier.width - x)};
        read_rows(earlier, y, columns, before);
        read_rows(later, y, columns, after);
        const double from_later = unlikeness(after.middle, before, columns.count),
                     from_earlier = unlikeness(before.middle, after, columns.count);
        const bool is_top = y % 2 == 0;
        sums.own += 0.5 * (unlikeness(before.middle, before, columns.count) +
                           unlikeness(after.middle, after, columns.count));
        sums.later_top += is_top ? from_later : from_earlier;
        sums.later_bottom += is_top ? from_earlier : from_later;
    }
}

Unlikeness compare(const defrec_image& earlier, const defrec_image& later) {
    // An odd step takes rows of both fields in turn.
    const uint32_t step = std::max(1u, earlier.height / ScanOrder::kRows) | 1u;
    Unlikeness sums;
    for (uint32_t y = 1; y + 1 < earlier.height; y += step) compare_rows(earlier, later, y, sums);
    return sums;
}

}  // namespace

uint32_t scan_order(const defrec_image& earlier, const defrec_image& later) {
    const auto [own, later_top, later_bottom] = compare(earlier, later);
    const double more = std::max(later_top, later_bottom) - own,
                 less = std::min(later_top, later_bottom) - own;
    if (!(more > ScanOrder::kMinExcess * own)) return DEFREC_SCAN_UNKNOWN;
    if (less > ScanOrder::kProgressive * more) return DEFREC_SCAN_PROGRESSIVE;
    if (less > ScanOrder::kInterlaced * more) return DEFREC_SCAN_UNKNOWN;
    // The fields that are nearer to each other in time are those of the earlier image's later field
    // and of the later image's earlier one.
    return later_top < later_bottom ? DEFREC_SCAN_TOP_FIRST : DEFREC_SCAN_BOTTOM_FIRST;
}

}  // namespace defrec
