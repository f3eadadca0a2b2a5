// How a picture shows a followed point, or a target beneath the surface.
#pragma once

#include "sdk/report/record.hpp"

namespace defrec::cli {

/// Pixels; NaN where something cannot be projected.
struct TargetMark {
    float u = 0, v = 0;
    float radius = 0;  ///< as long as the expected error appears, square to the line of sight
};

/// The mark of what is not unknown.
TargetMark target_mark(const PointEstimate& target, const Projector& projector);

}  // namespace defrec::cli
