// How deep places lie beneath the surface as it is in a frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

#include "sdk/report/record.hpp"

namespace defrec::cli {

class SurfaceDepth {
  public:
    struct Depth {
        float mm = 0;            // from the surface; negative on the camera's side of it
        cv::Vec3f place, above;  // above: the surface's nearest point
    };

    // vertices: x, y, z each, mm, in the camera that sees them, NaN where unknown. triangles: three
    // vertices each, all below the number of vertices.
    SurfaceDepth(std::span<const float> vertices, std::span<const std::uint32_t> triangles);

    // Empty where the surface's nearest point lies on its edge: the place is beside what is known,
    // not beneath it. Looks at the triangles of the nearest vertex: the distance is that of the
    // mesh or, by less than their size squared over twice the depth, more.
    std::optional<Depth> of(const cv::Vec3f& place) const;

    // The known vertex of the part that comes nearest to the surface.
    std::optional<Depth> of(const PlanEstimate& plan, const PlanModel::Part& part) const;

  private:
    using Corners = std::array<std::uint32_t, 3>;

    std::vector<cv::Vec3f> vertices_;
    std::vector<std::uint32_t> known_;  // vertices that are a corner of a triangle
    std::vector<Corners> triangles_;    // whose vertices are known
    std::vector<std::size_t> first_;    // in of_, of each vertex, and one more
    std::vector<std::uint32_t> of_;     // its triangles
    std::vector<bool> is_edge_;         // of the vertices: on the edge of the surface
};

}  // namespace defrec::cli
