// How points of the template frame move into a frame.
#pragma once
#include <span>

#include "backends/shared/motion.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

struct PointMotion {
    DualQuaternion<double> motion;
    bool is_near = true;  // the surface, if it lies beside it
    bool is_beside = false;
    size_t vertex = 0;       // of a point beside the surface: about the nearest to it
    double distance_mm = 0;  // from that vertex
};

// motions: of the control points. may_be_beside: a point beside the surface moves with the control
// points next to it; otherwise as those that the first view has nearest to its pixel.
PointMotion point_motion(const Template& surface, std::span<const defrec_motion> motions,
                         const Vec3<double>& point, bool may_be_beside);

}  // namespace defrec
