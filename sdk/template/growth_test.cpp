// A template that grows over a plane along which the camera moves.
#include "sdk/template/growth.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "backends/shared/motion.hpp"
#include "sdk/contract/stage_params.hpp"
#include "sdk/template/surface_index.hpp"
#include "sdk/template/test_capture.hpp"
#include "sdk/tracking/evidence/map_distance.hpp"

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 320, kHeight = 240;
constexpr defrec_camera kCamera{340, 340, 160, 120, 5, 0};
constexpr double kDepth = 80;

// What a camera sees that is `aside` mm to the right of where the template was captured.
struct View {
    std::vector<uint8_t> gray, mask;
    std::vector<int16_t> disparity;
    std::vector<defrec_feature> features;

    explicit View(double aside, double depth = kDepth) : View(aside, depth, depth) {}
    // Below the middle of the image another depth.
    View(double aside, double depth_above, double depth_below)
        : gray(kWidth * kHeight), mask(kWidth * kHeight, 255), disparity(kWidth * kHeight) {
        for (uint32_t y = 0; y < kHeight; ++y)
            for (uint32_t x = 0; x < kWidth; ++x) {
                const double depth = y < kHeight / 2 ? depth_above : depth_below;
                disparity[y * kWidth + x] = static_cast<int16_t>(
                    std::lround(16 * kCamera.fx * kCamera.baseline_mm / depth));
                const double along = (x - kCamera.cx) * depth / kCamera.fx + aside,
                             down = (y - kCamera.cy) * depth / kCamera.fy;
                gray[y * kWidth + x] = static_cast<uint8_t>(
                    128 + 40 * std::sin(1.9 * along + 0.3 * down) * std::cos(1.7 * down));
            }
        for (int32_t y = 20; y < 230; y += 30)
            for (int32_t x = 20; x < 310; x += 30) {
                defrec_feature feature{};
                feature.x = 16 * x;
                feature.y = 16 * y;
                features.push_back(feature);
            }
    }
    CaptureInput input() const {
        CaptureInput input = test::capture_input(kWidth, kHeight, kCamera, gray, mask, disparity);
        input.features = features;
        input.max_patches = 200;
        return input;
    }
};

// Motions of all control points: the camera moved aside.
std::vector<defrec_motion> moved_aside(const TemplateData& data, double aside) {
    const auto motion = from_rigid(Quaternion<double>{1, 0, 0, 0}, Vec3<double>{-aside, 0, 0});
    return std::vector<defrec_motion>(data.nodes.size() / 3, motion.store());
}

struct Scene {
    TemplateData data = *capture_template(View(0).input());

    Growth grow(const View& earlier, double earlier_aside, const View& now, double aside,
                size_t max_vertices = 100000) const {
        const auto then = moved_aside(data, earlier_aside), motions = moved_aside(data, aside);
        return grow_template(data, {earlier.input(), then}, {now.input(), motions}, max_vertices);
    }
    Growth grow_by(double aside) const {
        const View earlier(aside - 0.5), now(aside);
        return grow(earlier, aside - 0.5, now, aside);
    }
};

// Whether one array begins with another, byte for byte.
template <class T>
bool begins_with(const std::vector<T>& whole, const std::vector<T>& first) {
    return whole.size() >= first.size() &&
           std::memcmp(whole.data(), first.data(), first.size() * sizeof(T)) == 0;
}

}  // namespace

TEST_CASE("tissue beside the surface joins it, and what there was keeps its place") {
    const Scene scene;
    const Growth growth = scene.grow_by(12);
    REQUIRE(growth.outcome == Growth::Outcome::kGrown);
    const TemplateData &old = scene.data, &grown = growth.data;
    CHECK(begins_with(grown.vertices, old.vertices));
    CHECK(begins_with(grown.vertex_support, old.vertex_support));
    CHECK(begins_with(grown.triangles, old.triangles));
    CHECK(begins_with(grown.nodes, old.nodes));
    CHECK(begins_with(grown.edges, old.edges));
    CHECK(begins_with(grown.landmarks, old.landmarks));
    CHECK(begins_with(grown.patches, old.patches));
    CHECK(begins_with(grown.checks, old.checks));
    CHECK(begins_with(grown.image, old.image));
    CHECK(grown.grid.vertex == old.grid.vertex);
    for (const size_t more :
         {grown.nodes.size() - old.nodes.size(), grown.edges.size() - old.edges.size(),
          grown.landmarks.size() - old.landmarks.size(), grown.patches.size() - old.patches.size(),
          grown.checks.size() - old.checks.size()})
        CHECK(more > 0);
    // 12 mm of 75 came into view.
    const double share =
        static_cast<double>(grown.vertices.size()) / static_cast<double>(old.vertices.size());
    CHECK(share == doctest::Approx(1 + 12.0 / 75).epsilon(0.05));
    CHECK(growth.anchors.size() == (grown.nodes.size() - old.nodes.size()) / 3);
}

TEST_CASE("each piece grows by its own tissue, and nothing joins the pieces") {
    constexpr double kBelow = 100;
    const TemplateData old = *capture_template(View(0, kDepth, kBelow).input());
    REQUIRE(old.pieces() == 2);
    const View earlier(11.5, kDepth, kBelow), now(12, kDepth, kBelow);
    const auto then = moved_aside(old, 11.5), motions = moved_aside(old, 12);
    const Growth growth =
        grow_template(old, {earlier.input(), then}, {now.input(), motions}, 100000);
    REQUIRE(growth.outcome == Growth::Outcome::kGrown);
    const TemplateData& grown = growth.data;
    CHECK(grown.node_piece.size() == grown.nodes.size() / 3);
    CHECK(grown.pieces() == 2);
    const auto depth_of = [](size_t piece) { return piece == 0 ? kDepth : kBelow; };
    const bool first_is_above = old.vertices.front().position[2] < (kDepth + kBelow) / 2;
    size_t joined[2] = {};
    for (size_t i = old.vertices.size(); i < grown.vertices.size(); ++i) {
        const defrec_surface_point& vertex = grown.vertices[i];
        const size_t piece = grown.piece_of(vertex);
        ++joined[piece];
        CHECK(vertex.position[2] ==
              doctest::Approx(depth_of(first_is_above ? piece : 1 - piece)).epsilon(0.01));
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
            CHECK(grown.piece_of_node(static_cast<size_t>(vertex.node[k])) == piece);
    }
    CHECK(joined[0] > 50);
    CHECK(joined[1] > 50);
    for (size_t i = 0; i < grown.triangles.size(); i += 3)
        for (size_t k = 1; k < 3; ++k)
            CHECK(grown.piece_of(grown.vertices[grown.triangles[i + k]]) ==
                  grown.piece_of(grown.vertices[grown.triangles[i]]));
    for (const defrec_edge& edge : grown.edges)
        CHECK(grown.piece_of_node(static_cast<size_t>(edge.a)) ==
              grown.piece_of_node(static_cast<size_t>(edge.b)));
    for (const NearestNodes& anchor : growth.anchors)
        for (size_t k = 0; k < NearestNodes::kNodes; ++k)
            if (anchor.weight[k] > 0)
                CHECK(grown.piece_of_node(static_cast<size_t>(anchor.node[k])) ==
                      grown.piece_of_node(static_cast<size_t>(anchor.node[0])));

    // What is known on one piece says nothing of the other.
    const MapGrids grids(grown);
    std::vector<float> distance(grids.cells(), 1e6f);
    distance[grids.cell(0)] = 0;
    MapGrids::Workspace workspace;
    grids.spread(distance, workspace);
    for (size_t i = 0; i < grown.vertices.size(); ++i)
        CHECK((distance[grids.cell(i)] < 1e5f) ==
              (grown.piece_of(grown.vertices[i]) == grown.piece_of(grown.vertices[0])));
}

TEST_CASE("what joins lies at rest where it belongs") {
    const Scene scene;
    const TemplateData grown = scene.grow_by(12).data;
    const double rim = (kWidth - 1 - kCamera.cx) * kDepth / kCamera.fx;
    for (size_t i = scene.data.vertices.size(); i < grown.vertices.size(); ++i) {
        const defrec_surface_point& vertex = grown.vertices[i];
        CHECK(vertex.position[0] > rim - 1);
        CHECK(vertex.position[0] < rim + 12.5);
        CHECK(vertex.position[2] == doctest::Approx(kDepth).epsilon(0.005));
        CHECK(vertex.normal[2] < -0.99f);
        double sum = 0;
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
            CHECK(vertex.node[k] >= 0);
            CHECK(static_cast<size_t>(vertex.node[k]) < grown.nodes.size() / 3);
            sum += vertex.weight[k];
        }
        CHECK(sum == doctest::Approx(1));
    }
    for (size_t i = scene.data.nodes.size(); i < grown.nodes.size(); i += 3)
        CHECK(grown.nodes[i + 2] == doctest::Approx(kDepth).epsilon(0.005));
    // The texture of a patch, found in its view: it is where the patch has the tissue.
    for (size_t i = scene.data.patches.size(); i < grown.patches.size(); ++i) {
        const defrec_patch& patch = grown.patches[i];
        REQUIRE(patch.view == 1);
        const auto at =
            static_cast<size_t>((kHeight + std::lround(patch.v)) * kWidth + std::lround(patch.u));
        const double expected =
            128 + 40 * std::sin(1.9 * patch.position[0] + 0.3 * patch.position[1]) *
                      std::cos(1.7 * patch.position[1]);
        CHECK(std::abs(grown.image[at] - expected) < 8);
        CHECK(patch.tangent_u[0] == doctest::Approx(kDepth / kCamera.fx).epsilon(0.02));
        CHECK(patch.tangent_v[1] == doctest::Approx(kDepth / kCamera.fy).epsilon(0.02));
    }
}

TEST_CASE("new triangles face the camera and close the seam") {
    const Scene scene;
    const TemplateData grown = scene.grow_by(12).data;
    const auto at = [&](uint32_t vertex) { return grown.vertices[vertex].position; };
    double area = 0;
    for (size_t i = scene.data.triangles.size(); i < grown.triangles.size(); i += 3) {
        const float *a = at(grown.triangles[i]), *b = at(grown.triangles[i + 1]),
                    *c = at(grown.triangles[i + 2]);
        const double twice = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        CHECK(twice < 0);
        area -= twice / 2;
    }
    // The earlier frame did not show the last column of the grid.
    const double height = (kHeight - 1) * kDepth / kCamera.fy, width = 12 - 8 * kDepth / kCamera.fx;
    CHECK(area == doctest::Approx(width * height).epsilon(0.03));
}

TEST_CASE("nothing joins that is not beside the surface, or only one frame shows") {
    const Scene scene;
    CHECK(scene.grow_by(0).outcome == Growth::Outcome::kNothingNew);
    View blind(11.5);
    const View now(12);
    std::fill(blind.disparity.begin(), blind.disparity.end(), int16_t{DEFREC_DISPARITY_NONE});
    CHECK(scene.grow(blind, 11.5, now, 12).outcome == Growth::Outcome::kNothingNew);
    // The earlier frame did not reach as far.
    const View earlier(8);
    const Growth part = scene.grow(earlier, 8, now, 12);
    REQUIRE(part.outcome == Growth::Outcome::kGrown);
    CHECK(part.data.vertices.size() < scene.grow_by(12).data.vertices.size());
}

TEST_CASE("a frame whose depth is another than the surface's adds nothing") {
    const Scene scene;
    const View earlier(11.5, 83), now(12, 83);
    CHECK(scene.grow(earlier, 11.5, now, 12).outcome == Growth::Outcome::kUnfit);
}

TEST_CASE("a template that would be larger than its limit does not grow") {
    const Scene scene;
    const View earlier(11.5), now(12);
    const size_t grown = scene.grow_by(12).data.vertices.size();
    CHECK(scene.grow(earlier, 11.5, now, 12, grown).outcome == Growth::Outcome::kGrown);
    CHECK(scene.grow(earlier, 11.5, now, 12, grown - 1).outcome == Growth::Outcome::kFull);
}

TEST_CASE("a template has no more landmarks than stage match takes, and grows without them") {
    Scene scene;
    REQUIRE(scene.grow_by(12).data.landmarks.size() > scene.data.landmarks.size() + 2);
    scene.data.landmarks.resize(kMatchMaxLandmarks - 2, scene.data.landmarks.front());
    scene.data.landmark_points.resize(kMatchMaxLandmarks - 2, scene.data.landmark_points.front());
    const Growth growth = scene.grow_by(12);
    REQUIRE(growth.outcome == Growth::Outcome::kGrown);
    CHECK(growth.data.landmarks.size() == kMatchMaxLandmarks);
    CHECK(growth.data.landmark_points.size() == kMatchMaxLandmarks);
    CHECK(growth.data.vertices.size() > scene.data.vertices.size());
}

TEST_CASE("new control points move with those beside them") {
    const Scene scene;
    const Growth growth = scene.grow_by(12);
    const Quaternion<double> turn = rotation_from_vector(Vec3<double>{0.02, 0.2, -0.1});
    const auto motion = from_rigid(turn, Vec3<double>{3, -2, 5});
    std::vector<defrec_motion> motions(scene.data.nodes.size() / 3, motion.store());
    extend_motions(growth.data.nodes, growth.anchors, motions);
    REQUIRE(motions.size() == growth.data.nodes.size() / 3);
    for (const defrec_motion& each : motions) {
        const Vec3<double> p{40, 10, 85};
        const Vec3<double> off = apply(DualQuaternion<double>::load(each), p) - apply(motion, p);
        CHECK(std::sqrt(dot(off, off)) < 1e-3);
    }
}

TEST_CASE("points on tissue that joined move with its triangles") {
    const Scene scene;
    const Growth growth = scene.grow_by(12);
    std::vector<defrec_motion> motions;
    for (size_t i = 0; i < growth.data.nodes.size() / 3; ++i) {
        const double along = growth.data.nodes[3 * i] / 50;
        motions.push_back(from_rigid(rotation_from_vector(Vec3<double>{0, 0.05 * along, 0}),
                                     Vec3<double>{0, 0, 2 * along * along})
                              .store());
    }
    const Template surface(growth.data);
    const size_t first = scene.data.vertices.size();
    for (size_t i = first; i < growth.data.vertices.size(); i += 7) {
        const defrec_surface_point& vertex = growth.data.vertices[i];
        const Vec3<double> rest = load3<double>(vertex.position);
        const double xyz[3] = {rest.x, rest.y, rest.z};
        CHECK(surface.vertex_at(xyz) == static_cast<int32_t>(i));
        const Vec3<double> off =
            apply(surface.motion_at(xyz, motions.data()), rest) -
            apply(blend<double>(motions.data(), vertex.node, vertex.weight), rest);
        CHECK(std::sqrt(dot(off, off)) < 1e-3);
    }
    const double first_view[3] = {0, 0, kDepth}, beyond[3] = {100, 0, kDepth};
    CHECK(surface.vertex_at(first_view) >= 0);
    CHECK(surface.vertex_at(first_view) < static_cast<int32_t>(first));
    CHECK(surface.vertex_at(beyond) < 0);
}

TEST_CASE("distances on the surface go on where tissue joined") {
    const Scene scene;
    const TemplateData grown = scene.grow_by(12).data;
    const MapGrids grids(grown);
    std::vector<float> distance(grids.cells(), 1e6f);
    // From the middle of the left rim.
    const int32_t from =
        grown.grid.vertex[static_cast<size_t>(grown.grid.rows / 2 * grown.grid.columns)];
    REQUIRE(from >= 0);
    distance[grids.cell(static_cast<size_t>(from))] = 0;
    MapGrids::Workspace workspace;
    grids.spread(distance, workspace);
    const double step = 8 * kDepth / kCamera.fx;
    for (size_t i = scene.data.vertices.size(); i < grown.vertices.size(); ++i) {
        const float* position = grown.vertices[i].position;
        const double along = position[0] + kCamera.cx * kDepth / kCamera.fx,
                     down = std::abs(position[1]);
        // Chamfer distance, as the grid measures it.
        const double expected =
            std::max(along, down) + (std::sqrt(2.0) - 1) * std::min(along, down);
        CHECK(std::abs(distance[grids.cell(i)] * step - expected) < 3 * step);
    }
}
