// The colours of an image's cells.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "sdk/tracking/frame/field_copy.hpp"

namespace defrec {

// (red - green, blue - green) / (red + green + blue), which brightness does not change; NaN where
// no colour is known.
using Chromaticity = Eigen::Array2f;
inline Chromaticity no_colour() {
    return Chromaticity::Constant(std::numeric_limits<float>::quiet_NaN());
}

class ColourCells {
  public:
    // Makes cells for an image of that size, px; of gray values or with neither width nor height
    // there are none. Their colours are not known until read_rows().
    void begin(uint32_t format, uint32_t width, uint32_t height);
    // Reads the cells whose middle rows these are. Threads may share the rows of an image. field: a
    // DEFREC_FIELD_*, of which these rows are.
    void read_rows(const RawImage& image, uint32_t field, RowSpan rows);

    bool any() const { return !cells_.empty(); }
    // The colour of the cell of a pixel; beyond the image that of the nearest one.
    Chromaticity at(double x, double y) const;

  private:
    size_t cell_ = 1;  // px, each way
    size_t columns_ = 0, rows_ = 0;
    std::vector<Chromaticity> cells_;  // row by row
};

}  // namespace defrec
