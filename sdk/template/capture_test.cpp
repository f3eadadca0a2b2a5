// Capturing a template: what a known surface's disparity must give.
#include "sdk/template/capture.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "backends/shared/motion.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"

namespace {

using defrec::CaptureInput;
using defrec::TemplateData;

constexpr uint32_t kWidth = 321, kHeight = 201;

// Images of a surface given by its disparity (px) per pixel; a value <= 0 is a hole.
struct Scene {
    std::vector<uint8_t> gray, mask;
    std::vector<int16_t> disparity;
    std::vector<defrec_feature> features;
    CaptureInput input;

    explicit Scene(const std::function<double(double, double)>& disparity_at)
        : gray(kWidth * kHeight), mask(kWidth * kHeight, 255), disparity(kWidth * kHeight) {
        for (uint32_t y = 0; y < kHeight; ++y)
            for (uint32_t x = 0; x < kWidth; ++x) {
                const double d = disparity_at(x, y);
                const size_t i = y * kWidth + x;
                disparity[i] = d > 0 ? static_cast<int16_t>(std::lround(16 * d))
                                     : int16_t{DEFREC_DISPARITY_NONE};
                gray[i] = static_cast<uint8_t>(128 + 40 * std::sin(0.5 * x) * std::cos(0.4 * y));
            }
        for (int32_t y = 20; y < 190; y += 30)
            for (int32_t x = 20; x < 310; x += 30) {
                defrec_feature feature{};
                feature.x = 16 * x + 3;
                feature.y = 16 * y + 5;
                features.push_back(feature);
            }
    }
    const CaptureInput& prepared() {
        input.width = kWidth;
        input.height = kHeight;
        input.camera = {400, 400, 160, 100, 5, 0};
        input.gray = gray.data();
        input.mask = mask.data();
        input.disparity = disparity.data();
        input.features = features;
        input.vertex_spacing_px = 6;
        input.node_spacing_px = 20;
        input.max_patches = 200;
        return input;
    }
};

double smooth_disparity(double x, double y) {
    return 25 + 0.01 * x + 2 * std::sin(0.015 * y + 0.01 * x);
}

double lift_error_mm(const TemplateData& data, double u, double v, double true_disparity) {
    double disparity = 0, support = 0;
    REQUIRE(defrec::grid_disparity(data, u, v, disparity, support));
    const double focal_baseline = data.camera.fx * data.camera.baseline_mm;
    return std::abs(focal_baseline / disparity - focal_baseline / true_disparity);
}

}  // namespace

TEST_CASE("a smooth surface is lifted to within what 1/16 px of disparity allows") {
    Scene scene(smooth_disparity);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    for (double v = 3; v < kHeight; v += 17.3)
        for (double u = 3; u < kWidth; u += 19.7)
            CHECK(lift_error_mm(*data, u, v, smooth_disparity(u, v)) < 0.1);
}

TEST_CASE("disparities with an offset, of views that converge, give the same surface") {
    Scene scene(smooth_disparity),
        converging([](double x, double y) { return smooth_disparity(x, y) - 20; });
    CaptureInput input = converging.prepared();
    input.camera.disparity_offset_px = 20;
    const auto data = defrec::capture_template(scene.prepared()),
               other = defrec::capture_template(input);
    REQUIRE(data.has_value());
    REQUIRE(other.has_value());
    REQUIRE(other->vertices.size() == data->vertices.size());
    for (size_t i = 0; i < data->vertices.size(); ++i)
        for (int k = 0; k < 3; ++k)
            CHECK(other->vertices[i].position[k] ==
                  doctest::Approx(data->vertices[i].position[k]).epsilon(2e-5));
}

TEST_CASE("a fold wider than the smoothing keeps its height") {
    const auto fold = [](double x, double y) {
        const double across = (x - 160 + 0.3 * (y - 100)) / 25;
        return smooth_disparity(x, y) + std::exp(-across * across / 2);
    };
    Scene scene(fold);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    // 1 px of disparity is 2.9 mm there.
    for (double v = 20; v < kHeight - 20; v += 9.7)
        for (double u = 100; u < 220; u += 7.3)
            CHECK(lift_error_mm(*data, u, v, fold(u, v)) < 0.25);
}

TEST_CASE("noise of the disparity of far tissue makes no steps and no steep walls") {
    const auto tissue = [](double x, double) { return 10 + 0.004 * x; };
    Scene scene([&](double x, double y) {
        return tissue(x, y) + 0.3 * std::sin(0.21 * x) + 0.3 * std::cos(0.19 * y);
    });
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    CHECK(data->pieces() == 1);
    for (double v = 20; v < kHeight - 20; v += 17.3)
        for (double u = 20; u < kWidth - 20; u += 19.7) {
            double disparity = 0, support = 0;
            REQUIRE(defrec::grid_disparity(*data, u, v, disparity, support));
            CHECK(support == 0);
            CHECK(std::abs(disparity - tissue(u, v)) < 0.5);
        }
}

TEST_CASE("holes are filled from their rim and say how far the evidence is") {
    const auto with_hole = [](double x, double y) {
        return std::hypot(x - 160, y - 100) < 15 ? -1 : smooth_disparity(x, y);
    };
    Scene scene(with_hole);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    CHECK(lift_error_mm(*data, 160, 100, smooth_disparity(160, 100)) < 0.5);
    double disparity = 0, support = 0;
    REQUIRE(defrec::grid_disparity(*data, 160, 100, disparity, support));
    CHECK(support > 8);
    REQUIRE(defrec::grid_disparity(*data, 60, 60, disparity, support));
    CHECK(support == 0);
}

TEST_CASE("beyond its data the surface follows the trend, not the noise of the last cells") {
    // A lattice of normal noise, 24 px wide, as stereo errs over windows.
    std::mt19937 generator(3);
    std::normal_distribution<double> normal(0, 0.15);
    constexpr int kCell = 24, kColumns = kWidth / kCell + 2, kRows = kHeight / kCell + 2;
    std::vector<double> lattice(size_t{kColumns} * kRows);
    for (double& value : lattice) value = normal(generator);
    const auto noise = [&](double x, double y) {
        const double a = x / kCell, b = y / kCell, s = a - std::floor(a), t = b - std::floor(b);
        const size_t i = static_cast<size_t>(b) * kColumns + static_cast<size_t>(a);
        return std::lerp(std::lerp(lattice[i], lattice[i + 1], s),
                         std::lerp(lattice[i + kColumns], lattice[i + kColumns + 1], s), t);
    };
    const auto without_band = [&](double x, double y) {
        return x < 30 ? -1 : smooth_disparity(x, y) + noise(x, y);
    };
    Scene scene(without_band);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    double squares = 0;
    int count = 0;
    for (double v = 5; v < kHeight - 5; v += 5)
        for (double u = 3; u < 20; u += 5, ++count) {
            const double error = lift_error_mm(*data, u, v, smooth_disparity(u, v));
            squares += error * error;
        }
    CHECK(std::sqrt(squares / count) < 0.42);
}

TEST_CASE("an instrument in front is no part of the surface, nor is anything placed on it") {
    const auto on_instrument = [](double x, double y) { return x > 200 && x < 260 && y > 60; };
    const auto with_instrument = [&](double x, double y) {
        return on_instrument(x, y) ? 60 : smooth_disparity(x, y);
    };
    Scene scene(with_instrument);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    for (const defrec_surface_point& vertex : data->vertices)
        CHECK(vertex.position[2] > 400 * 5 / 40.0);
    for (const defrec_patch& patch : data->patches) {
        const bool inside = patch.u > 210 && patch.u < 250 && patch.v > 70;
        CHECK_FALSE(inside);
    }
    for (const defrec_surface_point& landmark : data->landmark_points)
        CHECK(landmark.position[2] > 400 * 5 / 40.0);
}

// Whether all that several control points move is moved by those of one piece.
bool is_of_one_piece(const TemplateData& data, const auto& item) {
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
        if (item.weight[k] > 0 &&
            data.piece_of_node(static_cast<size_t>(item.node[k])) != data.piece_of(item))
            return false;
    return true;
}

TEST_CASE("tissue behind a step or in front of it is a piece of its own, joined by nothing") {
    double other = 0;
    SUBCASE("behind") { other = 0.8; }
    SUBCASE("in front") { other = 1.25; }
    Scene scene([&](double x, double y) {
        return (x + 0.3 * y < 210 ? 1 : other) * smooth_disparity(x, y);
    });
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    REQUIRE(data->pieces() == 2);
    for (double v = 3; v < kHeight; v += 9.3)
        for (double u = 3; u < kWidth; u += 7.7) {
            CAPTURE(u);
            CAPTURE(v);
            const double from_step = 210 - u - 0.3 * v;
            if (std::abs(from_step) < 30) continue;
            const bool is_first = from_step > 0;
            CHECK(defrec::grid_piece(*data, u, v) == (is_first ? 0 : 1));
            CHECK(lift_error_mm(*data, u, v, (is_first ? 1 : other) * smooth_disparity(u, v)) <
                  0.25);
        }
    std::array<size_t, 2> vertices{};
    for (const defrec_surface_point& vertex : data->vertices) {
        CHECK(is_of_one_piece(*data, vertex));
        ++vertices[data->piece_of(vertex)];
    }
    CHECK(vertices[0] > vertices[1]);
    CHECK(vertices[1] > data->vertices.size() / 4);
    for (const defrec_surface_point& landmark : data->landmark_points)
        CHECK(is_of_one_piece(*data, landmark));
    for (const auto* patches : {&data->patches, &data->checks})
        for (const defrec_patch& patch : *patches) CHECK(is_of_one_piece(*data, patch));
    for (const defrec_edge& edge : data->edges)
        CHECK(data->piece_of_node(static_cast<size_t>(edge.a)) ==
              data->piece_of_node(static_cast<size_t>(edge.b)));
    for (size_t i = 0; i < data->triangles.size(); i += 3)
        for (size_t k = 1; k < 3; ++k)
            CHECK(data->piece_of(data->vertices[data->triangles[i + k]]) ==
                  data->piece_of(data->vertices[data->triangles[i]]));
}

TEST_CASE("a piece between the control points of a coarse grid is left out, the others are kept") {
    const auto between = [](double x, double y) {
        return x > 130 && x < 195 && y > 15 && y < 85 ? 0.8 : 1;
    };
    const auto at_corner = [](double x, double y) { return x > 280 && y > 150 ? 0.6 : 1; };
    size_t pieces = 0;
    std::function<double(double, double)> disparity;
    SUBCASE("one piece is left") {
        pieces = 1;
        disparity = [&](double x, double y) { return between(x, y) * smooth_disparity(x, y); };
    }
    SUBCASE("another piece is left, which came after it") {
        pieces = 2;
        disparity = [&](double x, double y) {
            return between(x, y) * at_corner(x, y) * smooth_disparity(x, y);
        };
    }
    Scene scene(disparity);
    REQUIRE(defrec::capture_template(scene.prepared())->pieces() == pieces + 1);
    scene.input.node_spacing_px = 100;
    const auto data = defrec::capture_template(scene.input);
    REQUIRE(data.has_value());
    CHECK(data->pieces() == pieces);
    CHECK(data->node_grid.node.size() == pieces * data->node_grid.cells());
    CHECK(data->node_piece.size() == (pieces > 1 ? data->nodes.size() / 3 : 0));
    CHECK(defrec::grid_piece(*data, 160, 50) == -1);
    CHECK(defrec::grid_piece(*data, 60, 120) == 0);
    if (pieces == 2) CHECK(defrec::grid_piece(*data, 300, 180) == 1);
    std::array<size_t, 2> vertices{};
    for (const defrec_surface_point& vertex : data->vertices) ++vertices[data->piece_of(vertex)];
    CHECK(vertices[pieces - 1] > 20);

    const defrec::test::TemporaryFolder folder;
    const std::string path = folder.path() / "template";
    defrec::Template(*data).save(path.c_str());
    const defrec::test::TestContext context;
    defrec_template loaded = nullptr;
    CHECK(defrec_template_load(context.get(), path.c_str(), &loaded) == DEFREC_OK);
    defrec_template_release(loaded);
}

TEST_CASE("tissue in front that the image's border cuts off is a piece, highlights and all") {
    const auto step = [](double x, double y) {
        const bool is_highlight = std::hypot(std::fmod(x, 40) - 20, std::fmod(y, 40) - 20) < 8;
        return is_highlight ? -1 : smooth_disparity(x, y) * (x > 240 ? 1.1 : 1);
    };
    Scene scene(step);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    CHECK(data->pieces() == 2);
    for (double v = 10; v < kHeight; v += 30) {
        CHECK(defrec::grid_piece(*data, 120, v) == 0);
        CHECK(defrec::grid_piece(*data, 290, v) == 1);
    }
}

TEST_CASE("a step is judged beside it, not by what the surface would be farther on") {
    // The left one goes on upwards and would pass through the middle of the right one.
    const auto step = [](double x, double) {
        return x < 160 ? 25 + 0.02 * (x - 160) : 26.5 - 0.004 * (x - 160);
    };
    Scene scene(step);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    CHECK(data->pieces() == 2);
    CHECK(defrec::grid_piece(*data, 120, 100) != defrec::grid_piece(*data, 200, 100));
}

TEST_CASE("points belong to the piece that was seen at their pixel, and move with it") {
    Scene scene([](double x, double y) { return (x < 160 ? 1 : 0.8) * smooth_disparity(x, y); });
    auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    const defrec::Template surface(std::move(*data));
    std::vector<defrec_motion> motions(surface.data().nodes.size() / 3);
    for (size_t i = 0; i < motions.size(); ++i) {
        const double aside = surface.data().piece_of_node(i) == 1 ? 7 : 0;
        motions[i] = defrec::from_rigid(defrec::Quaternion<double>{1, 0, 0, 0},
                                        defrec::Vec3<double>{aside, 0, 0})
                         .store();
    }
    const double uv[] = {80, 90, 240, 90, 150, 40, 170, 160};
    double xyz[12];
    uint8_t found[4];
    surface.lift(uv, 4, xyz, found);
    for (size_t i = 0; i < 4; ++i) {
        REQUIRE(found[i] == 1);
        const double* point = xyz + 3 * i;
        const bool is_second = uv[2 * i] > 160;
        CHECK(surface.piece_at(point) == (is_second ? 1 : 0));
        const auto moved = defrec::apply(surface.motion_at(point, motions.data()),
                                         defrec::Vec3<double>{point[0], point[1], point[2]});
        CHECK(moved.x - point[0] == doctest::Approx(is_second ? 7 : 0));
        const auto vertex = static_cast<size_t>(surface.vertex_at(point));
        CHECK(surface.data().piece_of(surface.data().vertices[vertex]) == (is_second ? 1 : 0));
    }
}

TEST_CASE(
    "triangles face the camera and name vertices that exist; normals have unit length towards the "
    "camera") {
    Scene scene(smooth_disparity);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    REQUIRE(data->triangles.size() > 1000);
    for (size_t t = 0; t < data->triangles.size(); t += 3) {
        double p[3][3];
        for (size_t corner = 0; corner < 3; ++corner) {
            REQUIRE(data->triangles[t + corner] < data->vertices.size());
            for (size_t axis = 0; axis < 3; ++axis)
                p[corner][axis] = data->vertices[data->triangles[t + corner]].position[axis];
        }
        double a[3], b[3];
        for (size_t axis = 0; axis < 3; ++axis) {
            a[axis] = p[1][axis] - p[0][axis];
            b[axis] = p[2][axis] - p[0][axis];
        }
        const double normal_dot_ray = (a[1] * b[2] - a[2] * b[1]) * p[0][0] +
                                      (a[2] * b[0] - a[0] * b[2]) * p[0][1] +
                                      (a[0] * b[1] - a[1] * b[0]) * p[0][2];
        CHECK(normal_dot_ray < 0);
    }
    for (const defrec_surface_point& vertex : data->vertices) {
        const float* n = vertex.normal;
        const float* p = vertex.position;
        CHECK(std::abs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-4);
        CHECK(n[0] * p[0] + n[1] * p[1] + n[2] * p[2] < 0);
    }
}

TEST_CASE(
    "blend weights sum to one and reproduce positions, so that a uniform stretch is no bending") {
    Scene scene(smooth_disparity);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    for (const defrec_surface_point& vertex : data->vertices) {
        float sum = 0, blended[3] = {0, 0, 0};
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
            REQUIRE(vertex.node[k] >= 0);
            REQUIRE(static_cast<size_t>(vertex.node[k]) < data->nodes.size() / 3);
            sum += vertex.weight[k];
            for (int axis = 0; axis < 3; ++axis)
                blended[axis] +=
                    vertex.weight[k] * data->nodes[static_cast<size_t>(3 * vertex.node[k] + axis)];
        }
        CHECK(sum == doctest::Approx(1).epsilon(1e-5));
        for (int axis = 0; axis < 2; ++axis)
            CHECK(std::abs(blended[axis] - vertex.position[axis]) < 0.6);
    }
}

TEST_CASE("connections are unique and ordered, and lead to the nearest eight") {
    Scene scene(smooth_disparity);
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    std::set<std::pair<int32_t, int32_t>> seen;
    for (const defrec_edge& edge : data->edges) {
        CHECK(edge.a < edge.b);
        CHECK(edge.weight > 0);
        CHECK(seen.emplace(edge.a, edge.b).second);
    }
    // One half of each edge is a control point's; at the border of the grid there are fewer.
    CHECK(data->edges.size() > 7 * data->nodes.size() / 3 / 2);
    CHECK(data->edges.size() < 10 * data->nodes.size() / 3 / 2);
}

TEST_CASE("too little disparity makes no template") {
    Scene empty([](double, double) { return -1.0; });
    CHECK_FALSE(defrec::capture_template(empty.prepared()).has_value());
    Scene corner([](double x, double y) { return x < 60 && y < 60 ? 25.0 : -1.0; });
    CHECK_FALSE(defrec::capture_template(corner.prepared()).has_value());
}

TEST_CASE("masked pixels give no patches") {
    Scene scene(smooth_disparity);
    for (size_t y = 50; y < 150; ++y)
        for (size_t x = 100; x < 200; ++x) scene.mask[y * kWidth + x] = 0;
    const auto data = defrec::capture_template(scene.prepared());
    REQUIRE(data.has_value());
    REQUIRE_FALSE(data->patches.empty());
    for (const defrec_patch& patch : data->patches) {
        const bool inside = patch.u >= 100 && patch.u < 200 && patch.v >= 50 && patch.v < 150;
        CHECK_FALSE(inside);
    }
}
