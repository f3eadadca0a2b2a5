// See point_motion.hpp.
#include "sdk/tracking/points/point_motion.hpp"

#include "sdk/template/nearest_surface.hpp"
#include "sdk/tracking/decisions/confidence.hpp"

namespace defrec {

PointMotion point_motion(const Template& surface, std::span<const defrec_motion> motions,
                         const Vec3<double>& point, bool may_be_beside) {
    const double xyz[3] = {point.x, point.y, point.z};
    PointMotion moves{surface.motion_at(xyz, motions.data())};
    if (!may_be_beside || surface.vertex_at(xyz) >= 0) return moves;
    const TemplateData& data = surface.data();
    const NearestSurface::Neighbours near = surface.nearest_surface().beside(data, point);
    moves.is_beside = true;
    moves.vertex = near.vertex;
    moves.distance_mm = near.distance_mm;
    moves.is_near = near.distance_mm <= decisions::Confidence::kFarthest;
    if (moves.is_near) moves.motion = follow_nearest_nodes(near.anchor, data.nodes, motions);
    return moves;
}

}  // namespace defrec
