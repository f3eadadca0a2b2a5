// See field_copy.hpp.
#include "sdk/tracking/frame/field_copy.hpp"

#include <algorithm>
#include <array>

#include "sdk/base/os/streaming_copy.hpp"
#include "sdk/contract/pixel_format.hpp"
#include "sdk/tracking/frame/gray_copy.hpp"

namespace defrec {
namespace {

// Columns that are made at a time: threads of callers may have small stacks.
constexpr size_t kColumns = 1024;
using Row = std::array<uint8_t, kColumns>;

struct Columns {
    size_t first, count;
};

// The field's rows in some columns, beyond its ends the last one. Each is read once where they are
// asked for in order.
class FieldRows {
  public:
    FieldRows(const RawImage& image, bool is_bottom, Columns columns)
        : image_(image),
          columns_(columns),
          first_(is_bottom ? 1 : 0),
          last_(image.height - 1 - (image.height - 1 - first_) % 2) {}

    bool has(size_t y) const { return y % 2 == first_; }
    const uint8_t* above(size_t y) { return at(y > first_ ? y - 1 : first_); }
    const uint8_t* below(size_t y) { return at(std::min(y + 1, last_)); }
    const uint8_t* at(size_t y) {
        const size_t place = y / 2 % rows_.size();
        if (held_[place] != y) {
            const uint8_t* pixels =
                image_.pixels + y * image_.stride + columns_.first * bytes_per_pixel(image_.format);
            copy_gray(image_.format, pixels, columns_.count, rows_[place].data(), false);
            held_[place] = y;
        }
        return rows_[place].data();
    }

  private:
    const RawImage& image_;
    const Columns columns_;
    const size_t first_, last_;
    std::array<size_t, 2> held_{SIZE_MAX, SIZE_MAX};
    std::array<Row, 2> rows_;
};

}  // namespace

void copy_field(const RawImage& image, bool is_bottom, RowSpan span, uint8_t* to, bool streams) {
    for (size_t column = 0; column < image.width; column += kColumns) {
        const Columns columns{column, std::min(kColumns, image.width - column)};
        FieldRows rows(image, is_bottom, columns);
        for (size_t y = span.first; y < span.last; ++y) {
            uint8_t* const row = to + (y - span.first) * image.width + column;
            Row between;
            const uint8_t* made = between.data();
            if (rows.has(y)) {
                made = rows.at(y);
            } else {
                const uint8_t *above = rows.above(y), *below = rows.below(y);
                for (size_t x = 0; x < columns.count; ++x)
                    between[x] = static_cast<uint8_t>((above[x] + below[x] + 1) / 2);
            }
            if (streams)
                streaming_copy(row, made, columns.count);
            else
                std::copy_n(made, columns.count, row);
        }
    }
}

}  // namespace defrec
