// See lift_pixels.hpp.
#include "sdk/tracking/points/lift_pixels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "backends/shared/motion.hpp"
#include "sdk/template/nearest_nodes.hpp"
#include "sdk/template/pixel_buckets.hpp"
#include "sdk/template/surface.hpp"
#include "sdk/tracking/decisions/points.hpp"
#include "sdk/tracking/points/point_motion.hpp"

namespace defrec {
namespace {

using Point = Vec3<double>;

constexpr double kBucketPx = 16;

// Where a pixel meets the surface.
struct Meeting {
    double depth = std::numeric_limits<double>::infinity();  // mm
    std::array<uint32_t, 3> corner{};
    std::array<double, 3> weight{};
};

struct Corner {
    Point place;
    double u, v;
};

// The meetings of the pixels within a triangle with it, where none before it is nearer.
void meet(const std::array<uint32_t, 3>& corners, const std::array<Corner, 3>& at,
          const PixelBuckets& pixels, std::vector<Meeting>& meetings) {
    const double area =
        (at[1].u - at[0].u) * (at[2].v - at[0].v) - (at[2].u - at[0].u) * (at[1].v - at[0].v);
    if (!(area < 0)) return;  // seen from behind
    const double u0 = std::min({at[0].u, at[1].u, at[2].u}),
                 u1 = std::max({at[0].u, at[1].u, at[2].u}),
                 v0 = std::min({at[0].v, at[1].v, at[2].v}),
                 v1 = std::max({at[0].v, at[1].v, at[2].v});
    const double reach = std::hypot(u1 - u0, v1 - v0) / 2 + 1e-3;
    pixels.near((u0 + u1) / 2, (v0 + v1) / 2, reach, [&](const PixelPoint& pixel, double) {
        // Shares of the image divided by depth are shares of the surface.
        std::array<double, 3> weight;
        double sum = 0;
        for (size_t k = 0; k < 3; ++k) {
            const Corner &a = at[(k + 1) % 3], &b = at[(k + 2) % 3];
            const double share =
                ((a.u - pixel.u) * (b.v - pixel.v) - (b.u - pixel.u) * (a.v - pixel.v)) / area;
            if (share < -1e-9) return;
            sum += weight[k] = share / at[k].place.z;
        }
        Meeting& meeting = meetings[static_cast<size_t>(pixel.index)];
        if (1 / sum >= meeting.depth) return;
        for (double& w : weight) w /= sum;
        meeting = {1 / sum, corners, weight};
    });
}

// Whether a coordinate of a pixel lies within the image; false for NaN.
bool is_inside(double position, uint32_t size) {
    return position >= -0.5 && position <= size - 0.5;
}

// The point that its motion takes to a place, from a guess on.
Point carry_back(const Template& surface, std::span<const defrec_motion> motions, Point place,
                 Point guess, bool may_be_beside) {
    constexpr int kRounds = 6;  // neighbouring points move nearly alike: each gains a digit or two
    for (int round = 0; round < kRounds; ++round)
        guess = apply(inverse(point_motion(surface, motions, guess, may_be_beside).motion), place);
    return guess;
}

// What was measured under pixels where the surface does not reach.
class Beside {
  public:
    Beside(const Template& surface, const LiftFrame& frame) : surface_(surface), frame_(frame) {
        const TemplateData& data = surface.data();
        input_.width = data.width;
        input_.height = data.height;
        input_.disparity = frame.disparity.data();
        using decisions::BesideSurface;
        radius_ = std::max(
            BesideSurface::kMinBesideReach,
            static_cast<int>(std::lround(BesideSurface::kBesideReach * data.grid.spacing)));
        nodes_ = node_positions(data.nodes, frame.motions);
    }

    // False where nothing was measured or the surface is far away.
    bool lift(double u, double v, Point& point) const {
        const TemplateData& data = surface_.data();
        const std::optional<double> disparity = measured_disparity(input_, u, v, radius_);
        if (!disparity) return false;
        const auto [x, y, z] = back_project(data.camera, u, v, *disparity);
        const Point place{x, y, z};
        const NearestNodes anchor =
            nearest_nodes_at(nodes_, data.node_piece, data.node_spacing_mm, place);
        const Point guess =
            apply(inverse(follow_nearest_nodes(anchor, data.nodes, frame_.motions)), place);
        point = carry_back(surface_, frame_.motions, place, guess, true);
        const double xyz[3] = {point.x, point.y, point.z};
        return point_motion(surface_, frame_.motions, point, true).is_near &&
               !frame_.is_lost(surface_.piece_at(xyz));
    }

  private:
    const Template& surface_;
    const LiftFrame& frame_;
    CaptureInput input_;
    int radius_;
    std::vector<Point> nodes_;
};

}  // namespace

void lift_pixels(const Template& surface, const LiftFrame& frame, std::span<const double> uv,
                 std::span<double> xyz, std::span<uint8_t> found) {
    const TemplateData& data = surface.data();
    const defrec_camera& camera = data.camera;
    std::vector<PixelPoint> pixels;
    for (size_t i = 0; i < found.size(); ++i)
        if (is_inside(uv[2 * i], data.width) && is_inside(uv[2 * i + 1], data.height))
            pixels.push_back({static_cast<int32_t>(i), uv[2 * i], uv[2 * i + 1]});
    const PixelBuckets sorted(pixels, kBucketPx);
    std::vector<Meeting> meetings(found.size());
    for (size_t i = 0; i + 2 < data.triangles.size(); i += 3) {
        const std::array<uint32_t, 3> corners{data.triangles[i], data.triangles[i + 1],
                                              data.triangles[i + 2]};
        if (frame.is_lost(surface.vertex_pieces()[corners[0]])) continue;
        std::array<Corner, 3> at{};
        bool is_before_camera = true;
        for (size_t k = 0; k < 3; ++k) {
            const Point p = load3<double>(&frame.vertices[3 * size_t{corners[k]}]);
            is_before_camera &= p.z > 1;
            at[k] = {p, camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
        }
        if (is_before_camera) meet(corners, at, sorted, meetings);
    }
    std::optional<Beside> beside;
    if (!frame.disparity.empty()) beside.emplace(surface, frame);
    for (size_t i = 0; i < found.size(); ++i) {
        const Meeting& meeting = meetings[i];
        found[i] = DEFREC_FOUND_NONE;
        Point point{0, 0, 0};
        if (std::isfinite(meeting.depth)) {
            found[i] = DEFREC_FOUND_SURFACE;
            const double z = meeting.depth;
            const Point place{(uv[2 * i] - camera.cx) * z / camera.fx,
                              (uv[2 * i + 1] - camera.cy) * z / camera.fy, z};
            for (size_t k = 0; k < 3; ++k)
                point = point + meeting.weight[k] *
                                    load3<double>(data.vertices[meeting.corner[k]].position);
            point = carry_back(surface, frame.motions, place, point, beside.has_value());
        } else if (beside && is_inside(uv[2 * i], data.width) &&
                   is_inside(uv[2 * i + 1], data.height) &&
                   beside->lift(uv[2 * i], uv[2 * i + 1], point)) {
            found[i] = DEFREC_FOUND_BESIDE;
        }
        xyz[3 * i] = point.x;
        xyz[3 * i + 1] = point.y;
        xyz[3 * i + 2] = point.z;
    }
}

}  // namespace defrec
