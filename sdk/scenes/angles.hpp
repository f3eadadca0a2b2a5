// Units of angles, rad.
#pragma once
#include <numbers>

namespace defrec::cli {

inline constexpr double kTwoPi = 2.0 * std::numbers::pi;
inline constexpr double kDegree = std::numbers::pi / 180.0;

}  // namespace defrec::cli
