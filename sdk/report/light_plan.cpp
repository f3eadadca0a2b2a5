// See light_plan.hpp. J. Rossignac and P. Borrel, Multi-resolution 3D approximations for rendering
// complex scenes, in: Modeling in Computer Graphics, 1993.
#include "sdk/report/light_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace defrec::cli {
namespace {

constexpr double kFirstCells = 64;  // along the model's diagonal
constexpr double kCoarser = 1.3;    // from one grid to the next

struct Box {
    std::array<double, 3> low{}, high{};
};

Box box_of(const std::vector<float>& xyz) {
    Box box;
    box.low.fill(std::numeric_limits<double>::infinity());
    box.high.fill(-std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < xyz.size(); ++i) {
        box.low[i % 3] = std::min(box.low[i % 3], double{xyz[i]});
        box.high[i % 3] = std::max(box.high[i % 3], double{xyz[i]});
    }
    return box;
}

struct Clusters {
    std::vector<std::uint32_t> kept, triangles;
    std::vector<PlanModel::Part> parts;
};

// cell: side of the grid's cells, mm; 0: every vertex stands for itself.
Clusters cluster(const PlanEstimate& plan, const Box& box, double cell, std::size_t most) {
    Clusters made;
    for (const PlanModel::Part& part : plan.model->parts) {
        std::map<std::array<std::int64_t, 3>, std::uint32_t> first;
        const auto stands_for = [&](std::uint32_t vertex) {
            std::array<std::int64_t, 3> key{vertex, 0, 0};
            for (std::size_t axis = 0; cell > 0 && axis < 3; ++axis)
                key[axis] = static_cast<std::int64_t>(std::floor(
                    (plan.vertices[3 * std::size_t{vertex} + axis] - box.low[axis]) / cell));
            const auto [place, is_new] =
                first.emplace(key, static_cast<std::uint32_t>(made.kept.size()));
            if (is_new) made.kept.push_back(vertex);
            return place->second;
        };
        const std::size_t begin = made.triangles.size() / 3;
        const std::uint32_t* corner = plan.model->triangles.data() + 3 * part.first_triangle;
        for (std::size_t i = 0; i < part.triangle_count; ++i, corner += 3) {
            const std::uint32_t a = stands_for(corner[0]), b = stands_for(corner[1]),
                                c = stands_for(corner[2]);
            if (a != b && b != c && c != a) made.triangles.insert(made.triangles.end(), {a, b, c});
            if (made.kept.size() > most) return made;
        }
        made.parts.push_back({part.name, begin, made.triangles.size() / 3 - begin});
    }
    return made;
}

}  // namespace

LightPlan::LightPlan(const PlanEstimate& plan) : all_(plan.vertices.size() / 3) {
    const Box box = box_of(plan.vertices);
    const double diagonal =
        std::hypot(box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2]);
    if (!std::isfinite(diagonal)) return;
    Clusters made = cluster(plan, box, 0, kVertices);
    for (double cell = diagonal / kFirstCells; made.kept.size() > kVertices && cell < diagonal;
         cell *= kCoarser)
        made = cluster(plan, box, cell, kVertices);
    if (made.kept.size() > kVertices) return;  // of more parts than vertices
    kept_ = std::move(made.kept);
    triangles_ = std::move(made.triangles);
    parts_ = std::move(made.parts);
}

std::vector<float> LightPlan::positions(const PlanEstimate& plan) const {
    std::vector<float> xyz;
    if (plan.vertices.size() != 3 * all_ || plan.status.size() != all_) return xyz;
    for (const std::uint32_t vertex : kept_)
        for (std::size_t axis = 0; axis < 3; ++axis)
            xyz.push_back(plan.status[vertex] == VertexStatus::unknown
                              ? std::numeric_limits<float>::quiet_NaN()
                              : plan.vertices[3 * std::size_t{vertex} + axis]);
    return xyz;
}

std::vector<float> LightPlan::expected_error_mm(const PlanEstimate& plan) const {
    std::vector<float> errors;
    if (plan.expected_error_mm.size() != all_) return errors;
    for (const std::uint32_t vertex : kept_) errors.push_back(plan.expected_error_mm[vertex]);
    return errors;
}

}  // namespace defrec::cli
