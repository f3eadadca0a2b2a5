#include "sdk/template/scattered_blend_weights.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

using namespace defrec;

namespace {

constexpr double kSpacing = 10;

// A grid of control points, each moved a little, so that none of the triangles is like another.
std::vector<PixelPoint> scattered() {
    std::vector<PixelPoint> points;
    for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 6; ++x)
            points.push_back({static_cast<int32_t>(points.size()),
                              kSpacing * x + 2.3 * std::sin(5.0 * x + y),
                              kSpacing * y + 2.3 * std::cos(3.0 * y + 2 * x)});
    return points;
}

// The pixel that the weights give.
std::pair<double, double> pixel_of(const std::vector<PixelPoint>& points,
                                   const BlendWeights& blend_weights) {
    double u = 0, v = 0;
    for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
        const PixelPoint& point = points[static_cast<size_t>(blend_weights.node[k])];
        u += blend_weights.weight[k] * point.u;
        v += blend_weights.weight[k] * point.v;
    }
    return {u, v};
}

}  // namespace

TEST_CASE("weights between scattered control points reproduce positions") {
    const std::vector<PixelPoint> points = scattered();
    const PixelBuckets buckets(points, kSpacing);
    for (double v = 6; v < 44; v += 1.7)
        for (double u = 6; u < 44; u += 1.3) {
            BlendWeights blend_weights;
            REQUIRE(scattered_blend_weights(buckets, kSpacing, u, v, blend_weights));
            double sum = 0;
            for (const float weight : blend_weights.weight) {
                CHECK(weight >= 0);
                sum += weight;
            }
            CHECK(sum == doctest::Approx(1));
            const auto [at_u, at_v] = pixel_of(points, blend_weights);
            CHECK(std::hypot(at_u - u, at_v - v) < 1e-4);
        }
}

TEST_CASE("of the triangles round a pixel the Delaunay triangle is taken") {
    // The short diagonal of a rhombus belongs to the triangulation.
    const std::vector<PixelPoint> rhombus = {{0, -8, 0}, {1, 8, 0}, {2, 0, -5}, {3, 0, 5}};
    const PixelBuckets buckets(rhombus, kSpacing);
    for (const double u : {-2.0, 2.0}) {
        BlendWeights blend_weights;
        REQUIRE(scattered_blend_weights(buckets, kSpacing, u, 1, blend_weights));
        std::set<int32_t> used;
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k)
            if (blend_weights.weight[k] > 0) used.insert(blend_weights.node[k]);
        CHECK(used == std::set<int32_t>{u < 0 ? 0 : 1, 2, 3});
    }
}

TEST_CASE("slopes are how the weights change from pixel to pixel") {
    // A plane at an angle to the image, seen by a camera far away.
    constexpr double kMmPerPx = 0.2;
    const auto on_plane = [](double u, double v) {
        return std::array<double, 3>{kMmPerPx * u, kMmPerPx * v, 80 + 0.1 * u - 0.05 * v};
    };
    const std::vector<PixelPoint> points = scattered();
    const PixelBuckets buckets(points, kSpacing);
    std::vector<float> nodes;
    for (const PixelPoint& point : points)
        for (const double x : on_plane(point.u, point.v)) nodes.push_back(static_cast<float>(x));
    size_t compared = 0;
    for (double v = 8; v < 42; v += 4.7)
        for (double u = 8; u < 42; u += 3.3) {
            CAPTURE(u);
            CAPTURE(v);
            BlendWeights here, right, below;
            REQUIRE(scattered_blend_weights(buckets, kSpacing, u, v, here));
            REQUIRE(scattered_blend_weights(buckets, kSpacing, u + 0.1, v, right));
            REQUIRE(scattered_blend_weights(buckets, kSpacing, u, v + 0.1, below));
            if (right.node != here.node || below.node != here.node) continue;
            ++compared;
            defrec_patch patch{};
            std::copy(here.node.begin(), here.node.end(), patch.node);
            for (size_t axis = 0; axis < 3; ++axis) {
                patch.tangent_u[axis] =
                    static_cast<float>(on_plane(u + 1, v)[axis] - on_plane(u, v)[axis]);
                patch.tangent_v[axis] =
                    static_cast<float>(on_plane(u, v + 1)[axis] - on_plane(u, v)[axis]);
            }
            const defrec_patch_slope slope = scattered_slope(nodes, patch);
            for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
                CHECK(slope.weight_u[k] == doctest::Approx((right.weight[k] - here.weight[k]) / 0.1)
                                               .scale(0.1)
                                               .epsilon(1e-2));
                CHECK(slope.weight_v[k] == doctest::Approx((below.weight[k] - here.weight[k]) / 0.1)
                                               .scale(0.1)
                                               .epsilon(1e-2));
            }
        }
    CHECK(compared > 30);
    defrec_patch beyond{};  // two control points move it
    beyond.node[1] = 1;
    beyond.tangent_u[0] = beyond.tangent_v[1] = 0.2f;
    for (const float weight : scattered_slope(nodes, beyond).weight_u) CHECK(weight == 0);
}

TEST_CASE("beyond the control points the nearest place between two of them counts") {
    const std::vector<PixelPoint> points = scattered();
    const PixelBuckets buckets(points, kSpacing);
    BlendWeights blend_weights;
    REQUIRE(scattered_blend_weights(buckets, kSpacing, 25, 60, blend_weights));
    const auto [u, v] = pixel_of(points, blend_weights);
    CHECK(std::abs(u - 25) < 5);
    CHECK(v > 45);
    CHECK_FALSE(scattered_blend_weights(buckets, kSpacing, 25, 500, blend_weights));
    const PixelBuckets alone({{7, 3, 3}}, kSpacing);
    CHECK_FALSE(scattered_blend_weights(alone, kSpacing, 3, 3, blend_weights));
}
