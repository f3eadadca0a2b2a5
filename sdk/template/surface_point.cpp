// See surface_point.hpp.
#include "sdk/template/surface_point.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>

namespace defrec {
namespace {

using Point = std::array<double, 3>;

Eigen::Vector3d as_vector(const Point& p) { return {p[0], p[1], p[2]}; }

// How the surface point under a pixel moves for one pixel to the right and one down.
struct Tangents {
    Eigen::Vector3d u, v;
    bool valid = false;
};

// Over a whole grid cell to either side, since within one bilinear interpolation has kinks; at the
// surface's rim to one side.
Tangents tangents_at(const TemplateData& data, double u, double v) {
    const double step = data.grid.spacing;
    const int piece = grid_piece(data, u, v);
    const auto along = [&](double du, double dv, Eigen::Vector3d& tangent) {
        Eigen::Vector3d end[2];
        double at[2];
        for (int side = 0; side < 2; ++side) {
            const double sign = side == 0 ? -1 : 1;
            const double x = std::clamp(u + sign * du, 0.0, data.width - 1.0),
                         y = std::clamp(v + sign * dv, 0.0, data.height - 1.0);
            double disparity = 0, support = 0;
            const bool there = grid_disparity(data, piece, x, y, disparity, support);
            if (!there && !grid_disparity(data, piece, u, v, disparity, support)) return false;
            end[side] =
                as_vector(back_project(data.camera, there ? x : u, there ? y : v, disparity));
            at[side] = there ? (x - u) + (y - v) : 0;
        }
        if (!(at[1] - at[0] > 0)) return false;
        tangent = (end[1] - end[0]) / (at[1] - at[0]);
        return true;
    };
    Tangents tangents;
    tangents.valid = along(step, 0, tangents.u) && along(0, step, tangents.v);
    return tangents;
}

// Where it lies and what moves it.
bool point_at(const TemplateData& data, double u, double v, defrec_surface_point& out,
              SurfacePlace& place) {
    BlendWeights blend_weights;
    const int piece = grid_piece(data, u, v);
    if (piece < 0 ||
        !grid_blend_weights(data.node_grid, static_cast<size_t>(piece), u, v, blend_weights) ||
        !surface_place(data, u, v, place))
        return false;
    for (int axis = 0; axis < 3; ++axis) {
        out.position[axis] = static_cast<float>(place.position[axis]);
        out.normal[axis] = static_cast<float>(place.normal[axis]);
    }
    std::copy(blend_weights.node.begin(), blend_weights.node.end(), out.node);
    std::copy(blend_weights.weight.begin(), blend_weights.weight.end(), out.weight);
    return true;
}

}  // namespace

bool surface_place(const TemplateData& data, double u, double v, SurfacePlace& place) {
    double disparity = 0, support = 0;
    if (!grid_disparity(data, u, v, disparity, support)) return false;
    const Tangents tangents = tangents_at(data, u, v);
    if (!tangents.valid) return false;
    const Eigen::Vector3d position = as_vector(back_project(data.camera, u, v, disparity));
    Eigen::Vector3d normal = tangents.v.cross(tangents.u);
    const double length = normal.norm();
    if (!(length > 0)) return false;
    normal *= (normal.dot(position) < 0 ? 1 : -1) / length;
    place = {position, normal, tangents.u, tangents.v};
    return true;
}

bool surface_point(const TemplateData& data, double u, double v, defrec_surface_point& point) {
    SurfacePlace place;
    return point_at(data, u, v, point, place);
}

bool surface_patch(const TemplateData& data, double u, double v, defrec_patch& patch) {
    defrec_surface_point point{};
    SurfacePlace place;
    if (!point_at(data, u, v, point, place)) return false;
    patch = {};
    patch.u = static_cast<float>(u);
    patch.v = static_cast<float>(v);
    for (int axis = 0; axis < 3; ++axis) {
        patch.position[axis] = point.position[axis];
        patch.tangent_u[axis] = static_cast<float>(place.tangent_u[axis]);
        patch.tangent_v[axis] = static_cast<float>(place.tangent_v[axis]);
    }
    std::copy(std::begin(point.node), std::end(point.node), patch.node);
    std::copy(std::begin(point.weight), std::end(point.weight), patch.weight);
    return true;
}

}  // namespace defrec
