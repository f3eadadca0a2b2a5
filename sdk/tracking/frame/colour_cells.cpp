// See colour_cells.hpp.
#include "sdk/tracking/frame/colour_cells.hpp"

#include <algorithm>
#include <array>

#include "include/defrec_c.h"
#include "sdk/contract/pixel_format.hpp"
#include "sdk/tracking/decisions/unseen.hpp"

namespace defrec {
namespace {

using Decision = decisions::TissueColours;

// Pixels that are saturated are not read: a highlight has the colour of the lamp.
Chromaticity mean_colour(const uint8_t* pixel, size_t step, size_t red, size_t blue) {
    std::array<int, 3> sum{};
    int read = 0;
    for (int i = 0; i < Decision::kSamples; ++i, pixel += step) {
        if (std::max({pixel[red], pixel[1], pixel[blue]}) >= Decision::kSaturated) continue;
        sum[0] += pixel[red];
        sum[1] += pixel[1];
        sum[2] += pixel[blue];
        ++read;
    }
    const int all = sum[0] + sum[1] + sum[2];
    if (2 * read < Decision::kSamples ||
        all < static_cast<int>(sum.size()) * read * Decision::kDarkest)
        return no_colour();
    return Chromaticity(static_cast<float>(sum[0] - sum[1]), static_cast<float>(sum[2] - sum[1])) /
           static_cast<float>(all);
}

}  // namespace

void ColourCells::begin(uint32_t format, uint32_t width, uint32_t height) {
    cell_ = std::max<size_t>(Decision::kSamples, width / Decision::kAcross);
    columns_ = width / cell_;
    rows_ = height / cell_;
    cells_.assign(format == DEFREC_FORMAT_GRAY8 ? 0 : columns_ * rows_, no_colour());
}

void ColourCells::read_rows(const RawImage& image, uint32_t field, RowSpan rows) {
    if (!any()) return;
    const size_t bytes = bytes_per_pixel(image.format),
                 red = image.format == DEFREC_FORMAT_RGB8 ? 0 : 2, blue = 2 - red,
                 step = cell_ / Decision::kSamples * bytes;
    for (size_t row = rows.first / cell_; row < std::min(rows_, rows.last / cell_ + 1); ++row) {
        size_t y = row * cell_ + cell_ / 2;
        if (field != DEFREC_FIELD_NONE) y = y / 2 * 2 + (field == DEFREC_FIELD_BOTTOM ? 1 : 0);
        if (y < rows.first || y >= rows.last) continue;
        const uint8_t* first = image.pixels + y * image.stride;
        for (size_t column = 0; column < columns_; ++column)
            cells_[row * columns_ + column] =
                mean_colour(first + column * cell_ * bytes, step, red, blue);
    }
}

Chromaticity ColourCells::at(double x, double y) const {
    const auto index = [this](double at, size_t count) {
        return std::min(count - 1, static_cast<size_t>(std::max(0.0, at)) / cell_);
    };
    return cells_[index(y, rows_) * columns_ + index(x, columns_)];
}

}  // namespace defrec
