// Places beside the surface of a plane, and how they move.
#include "sdk/template/nearest_surface.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "backends/shared/motion.hpp"
#include "sdk/template/test_capture.hpp"

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 320, kHeight = 240;
constexpr defrec_camera kCamera{340, 340, 160, 120, 5, 0};
constexpr double kDepth = 80;
constexpr double kRim = (kWidth - 1 - 160) * kDepth / 340;  // mm to the right of the middle

TemplateData plane() {
    const std::vector<uint8_t> gray(kWidth * kHeight, 100), mask(kWidth * kHeight, 255);
    const std::vector<int16_t> disparity(
        kWidth * kHeight,
        static_cast<int16_t>(std::lround(16 * kCamera.fx * kCamera.baseline_mm / kDepth)));
    return *capture_template(test::capture_input(kWidth, kHeight, kCamera, gray, mask, disparity));
}

}  // namespace

TEST_CASE("the nearest vertex beside a surface is about at its rim") {
    const TemplateData data = plane();
    const NearestSurface nearest_surface(data);
    for (const double away : {3.0, 10.0, 30.0}) {
        CAPTURE(away);
        const auto near = nearest_surface.beside(data, {kRim + away, 4, kDepth});
        CHECK(near.distance_mm == doctest::Approx(away).epsilon(0.1));
        const float* vertex = data.vertices[near.vertex].position;
        CHECK(vertex[0] > kRim - 2);
        CHECK(std::abs(vertex[1] - 4) < 2);
    }
}

TEST_CASE("a place beside a surface moves rigidly with the control points next to it") {
    const TemplateData data = plane();
    const NearestSurface nearest_surface(data);
    const Vec3<double> place{kRim + 5, 10, kDepth};
    const auto near = nearest_surface.beside(data, place);
    for (size_t k = 0; k < NearestNodes::kNodes; ++k) {
        const float* node = &data.nodes[3 * static_cast<size_t>(near.anchor.node[k])];
        CHECK(std::hypot(node[0] - place.x, node[1] - place.y) < 25);
        CHECK(near.anchor.weight[k] > 0);
        CHECK(near.anchor.weight[k] <= 1);
    }
    // Control points on the left stay where they are, and do not count.
    const auto turned =
        from_rigid(rotation_from_vector(Vec3<double>{0.02, 0.2, -0.1}), Vec3<double>{3, -2, 5});
    std::vector<defrec_motion> motions;
    for (size_t i = 0; i < data.nodes.size(); i += 3)
        motions.push_back(
            (data.nodes[i] < 0 ? DualQuaternion<double>::identity() : turned).store());
    const Vec3<double> off =
        apply(follow_nearest_nodes(near.anchor, data.nodes, motions), place) - apply(turned, place);
    CHECK(std::sqrt(dot(off, off)) < 1e-3);
}
