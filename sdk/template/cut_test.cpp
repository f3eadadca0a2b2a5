// A plane that is cut along a line through the middle of its image.
#include "sdk/template/cut.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "backends/shared/motion.hpp"
#include "sdk/template/test_capture.hpp"

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 320, kHeight = 240;
constexpr defrec_camera kCamera{340, 340, 160, 120, 5, 0};
constexpr double kDepth = 80, kCutU = 163, kFrom = 60, kTo = 180;  // px

TemplateData plane() {
    const test::PlaneImages images(kWidth, kHeight, kCamera, kDepth);
    std::vector<defrec_feature> features;
    for (int32_t x = 20; x < 310; x += 15) {
        defrec_feature feature{};
        feature.x = 16 * x;
        feature.y = 16 * 120;
        features.push_back(feature);
    }
    CaptureInput input =
        test::capture_input(kWidth, kHeight, kCamera, images.gray, images.mask, images.disparity);
    input.features = features;
    input.max_patches = 300;
    return *capture_template(input);
}

CutLine middle_cut() { return {0, {{kCutU, kFrom}, {kCutU, (kFrom + kTo) / 2}, {kCutU, kTo}}}; }

double u_of(const float xyz[3]) { return kCamera.fx * xyz[0] / xyz[2] + kCamera.cx; }
double v_of(const float xyz[3]) { return kCamera.fy * xyz[1] / xyz[2] + kCamera.cy; }

// -1 left of the cut, 1 right of it, 0 beyond its ends.
int side_of(double u, double v) { return v <= kFrom + 1 || v >= kTo - 1 ? 0 : u < kCutU ? -1 : 1; }

// Whether what moves something at a pixel lies on the other side of the cut.
template <class Item>
bool is_moved_across(const TemplateData& data, const Item& item, double u, double v) {
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
        const float* node = &data.nodes[3 * static_cast<size_t>(item.node[k])];
        if (item.weight[k] > 0 && side_of(u, v) * side_of(u_of(node), v_of(node)) < 0) return true;
    }
    return false;
}

}  // namespace

TEST_CASE("nothing crosses a cut, and beyond its ends all stays connected") {
    const TemplateData whole = plane(), parted = release_across(whole, middle_cut());
    const auto crossing = [](const TemplateData& data) {
        return std::count_if(data.edges.begin(), data.edges.end(), [&](const defrec_edge& edge) {
            const float *a = &data.nodes[3 * static_cast<size_t>(edge.a)],
                        *b = &data.nodes[3 * static_cast<size_t>(edge.b)];
            return side_of(u_of(a), v_of(a)) * side_of(u_of(b), v_of(b)) < 0;
        });
    };
    CHECK(crossing(whole) > 10);
    CHECK(crossing(parted) == 0);
    CHECK(parted.edges.size() > whole.edges.size() - 2 * static_cast<size_t>(crossing(whole)));
    // Those that are left are what they were.
    for (const defrec_edge& edge : parted.edges)
        CHECK(std::any_of(whole.edges.begin(), whole.edges.end(), [&](const defrec_edge& before) {
            return before.a == edge.a && before.b == edge.b && before.weight == edge.weight;
        }));

    REQUIRE(parted.vertices.size() == whole.vertices.size());
    size_t across_before = 0, changed = 0;
    for (size_t i = 0; i < parted.vertices.size(); ++i) {
        const defrec_surface_point &now = parted.vertices[i], &before = whole.vertices[i];
        CHECK(std::equal(now.position, now.position + 3, before.position));
        const double u = u_of(now.position), v = v_of(now.position);
        across_before += is_moved_across(whole, before, u, v);
        CHECK(!is_moved_across(parted, now, u, v));
        const float sum = now.weight[0] + now.weight[1] + now.weight[2] + now.weight[3];
        CHECK(sum == doctest::Approx(1));
        const bool is_same = std::equal(now.weight, now.weight + 4, before.weight) &&
                             std::equal(now.node, now.node + 4, before.node);
        changed += !is_same;
        if (std::abs(u - kCutU) > 2 * whole.node_grid.spacing_u) CHECK(is_same);
    }
    CHECK(across_before > 20);
    CHECK(changed >= across_before);
    for (size_t i = 0; i < parted.landmarks.size(); ++i) {
        const defrec_surface_point& point = parted.landmark_points[i];
        CHECK(!is_moved_across(parted, point, u_of(point.position), v_of(point.position)));
    }
    for (const auto* patches : {&parted.patches, &parted.checks})
        for (const defrec_patch& patch : *patches)
            CHECK(!is_moved_across(parted, patch, double{patch.u}, double{patch.v}));
}

TEST_CASE("triangles across a cut have no area, and keep their places") {
    const TemplateData whole = plane(), parted = release_across(whole, middle_cut());
    REQUIRE(parted.triangles.size() == whole.triangles.size());
    size_t released = 0;
    for (size_t i = 0; i < whole.triangles.size(); i += 3) {
        bool is_across = false;
        for (size_t k = 0; k < 3; ++k) {
            const float *a = whole.vertices[whole.triangles[i + k]].position,
                        *b = whole.vertices[whole.triangles[i + (k + 1) % 3]].position;
            is_across |= side_of(u_of(a), v_of(a)) * side_of(u_of(b), v_of(b)) < 0;
        }
        const uint32_t* corner = &parted.triangles[i];
        const bool is_released = corner[0] == corner[1] && corner[1] == corner[2];
        if (is_across) CHECK(is_released);
        released += is_released;
        if (!is_released)
            CHECK(std::equal(corner, corner + 3, whole.triangles.begin() + std::ptrdiff_t(i)));
    }
    const double rows = (kTo - kFrom) / 8;
    CHECK(static_cast<double>(released) >= 2 * rows - 4);
    CHECK(static_cast<double>(released) <= 2 * rows + 4);
}

TEST_CASE("points beside a cut move with their own side") {
    const Template surface(release_across(plane(), middle_cut()));
    // What lies right of the cut moves 5 mm to the right.
    std::vector<defrec_motion> motions;
    for (size_t i = 0; i < surface.data().nodes.size(); i += 3) {
        const bool is_right = u_of(&surface.data().nodes[i]) > kCutU;
        motions.push_back(
            from_rigid(Quaternion<double>{1, 0, 0, 0}, Vec3<double>{is_right ? 5.0 : 0.0, 0, 0})
                .store());
    }
    for (const double u : {kCutU - 3, kCutU - 0.5, kCutU + 0.5, kCutU + 3}) {
        const double uv[2] = {u, 120};
        double xyz[3];
        uint8_t found = 0;
        surface.lift(uv, 1, xyz, &found);
        REQUIRE(found == 1);
        const Vec3<double> now =
            apply(surface.motion_at(xyz, motions.data()), Vec3<double>{xyz[0], xyz[1], xyz[2]});
        CHECK(now.x - xyz[0] == doctest::Approx(u < kCutU ? 0 : 5));
    }
}

TEST_CASE("a cut is told as points on the surface at rest") {
    const Template surface(release_across(plane(), middle_cut()));
    defrec_template_info info{};
    surface.info(info);
    REQUIRE(info.cut_point_count == 3);
    for (size_t i = 0; i < 3; ++i) {
        CHECK(info.cut_points[i].cut == 0);
        CHECK(double{info.cut_points[i].position[2]} == doctest::Approx(kDepth).epsilon(0.01));
        CHECK(u_of(info.cut_points[i].position) == doctest::Approx(kCutU).epsilon(0.001));
    }
    Template(plane()).info(info);
    CHECK(info.cut_point_count == 0);
}
