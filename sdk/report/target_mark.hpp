// How a picture shows a target beneath the surface.
#pragma once

#include "sdk/report/record.hpp"

namespace defrec::cli {

/// Pixels; NaN where something cannot be projected.
struct TargetMark {
    float u = 0, v = 0;
    float radius = 0;  ///< as long as the expected error appears, square to the line of sight
};

/// The mark of a target that is not unknown.
TargetMark target_mark(const TargetEstimate& target, const Projector& projector);

/// Root mean square of the error to be expected, mm.
float expected_error(const TargetEstimate& target);

}  // namespace defrec::cli
