// The ellipsoid of one standard deviation of a point's error, as the page draws it.
#pragma once

#include <array>
#include <cstdint>

namespace defrec::cli {

/// Shapes are kept in steps of 0.001 mm.
inline constexpr double kShapeStepMm = 0.001;

/// Lower triangle L of the covariance C = L L^T (xx, xy, xz, yy, yz, zz, mm^2) in steps, row by
/// row: it maps the unit sphere to the ellipsoid. A direction without variance is flat.
std::array<std::int16_t, 6> ellipsoid_shape(const std::array<float, 6>& covariance);

}  // namespace defrec::cli
