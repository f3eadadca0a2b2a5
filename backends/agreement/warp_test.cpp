// Stage warp: properties that hold for any backend, and agreement with the definition.
#include <doctest/doctest.h>

#include <cstring>

#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "backends/shared/test_surface.hpp"
#include "sdk/contract/stage_params.hpp"
#include DEFREC_UNDER_TEST

using namespace defrec;
using namespace defrec::test;

namespace {

using Maker = std::unique_ptr<Stage> (*)(const defrec_warp_params&, const Host&);
constexpr Maker kMakers[] = {reference::make_warp, under_test::make_warp};

template <class T>
InBuffer in(const std::vector<T>& values) {
    return {values.data(), values.size() * sizeof(T)};
}

struct WarpRun {
    explicit WarpRun(const TestSurface& surface) : points(surface.points) {
        const defrec_lm_params lm = surface.lm_params();
        params.struct_size = sizeof params;
        params.nodes = lm.nodes;
        params.width = lm.width;
        params.height = lm.height;
        params.camera = lm.camera;
        fill_defaults(params);
    }
    std::vector<defrec_surface_sample> operator()(Maker make,
                                                  const std::vector<defrec_motion>& motions,
                                                  const std::vector<int16_t>* disparity,
                                                  uint32_t threads = 2) {
        TestHost host(threads);
        params.points = uint32_t(points.size());
        const auto stage = make(params, host.host());
        const InBuffer prepared[] = {in(points)};
        stage->prepare(prepared);
        std::vector<defrec_surface_sample> samples(points.size());
        const InBuffer given[] = {in(motions), disparity ? in(*disparity) : InBuffer{}};
        const OutBuffer results[] = {{samples.data(), samples.size() * sizeof(samples[0])}};
        stage->run(given, results);
        return samples;
    }
    defrec_warp_params params{};
    std::vector<defrec_surface_point> points;
};

std::vector<defrec_motion> all(const TestSurface& surface, Quaternion<double> rotation,
                               Vec3<double> t) {
    return std::vector<defrec_motion>(surface.rest().size(), from_rigid(rotation, t).store());
}
// Checks positions and normals (docs/numerics.md); returns how many points differ in residual or
// observation.
size_t check_agreement(const std::vector<defrec_surface_sample>& actual,
                       const std::vector<defrec_surface_sample>& expected) {
    size_t different = 0;
    for (size_t i = 0; i < expected.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            CHECK(std::abs(expected[i].position[c] - actual[i].position[c]) < 2e-4f);
            CHECK(std::abs(expected[i].normal[c] - actual[i].normal[c]) < 2e-5f);
        }
        if (expected[i].observation != actual[i].observation ||
            std::abs(expected[i].residual - actual[i].residual) > 2e-3f)
            ++different;
    }
    return different;
}
size_t count(const std::vector<defrec_surface_sample>& samples, uint32_t observation) {
    return size_t(std::count_if(samples.begin(), samples.end(),
                                [&](const auto& s) { return s.observation == observation; }));
}

}  // namespace

TEST_CASE("a surface at rest is observed where it was seen") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform([](Vec3<double> p) { return p; });
    for (const Maker make : kMakers) {
        const auto samples = WarpRun(surface)(make, surface.rest(), &surface.disparity);
        CHECK(count(samples, DEFREC_OBSERVED) + count(samples, DEFREC_OUTSIDE) == samples.size());
        CHECK(count(samples, DEFREC_OBSERVED) > samples.size() * 9 / 10);
        for (size_t i = 0; i < samples.size(); ++i) {
            for (int c = 0; c < 3; ++c) {
                CHECK(samples[i].position[c] ==
                      doctest::Approx(surface.points[i].position[c]).epsilon(1e-5));
                CHECK(std::abs(samples[i].normal[c] - surface.points[i].normal[c]) < 1e-5f);
            }
            if (samples[i].observation == DEFREC_OBSERVED)
                CHECK(std::abs(samples[i].residual) < 0.25f);  // 1/16 px is 0.35 mm here
        }
    }
}

TEST_CASE(
    "a live surface in front occludes, one behind is inconsistent, and the residual is the "
    "distance in depth") {
    if (!under_test::available()) return;
    TestSurface surface({});
    const Quaternion<double> still{1, 0, 0, 0};
    for (const double shift : {-12.0, 12.0}) {
        surface.deform([&](Vec3<double> p) { return Vec3<double>{p.x, p.y, p.z + shift}; });
        for (const Maker make : kMakers) {
            const auto samples =
                WarpRun(surface)(make, all(surface, still, {0, 0, 0}), &surface.disparity);
            const uint32_t expected = shift < 0 ? DEFREC_OCCLUDED : DEFREC_INCONSISTENT;
            CHECK(count(samples, expected) + count(samples, DEFREC_OUTSIDE) == samples.size());
            for (const auto& s : samples)
                if (s.observation != DEFREC_OUTSIDE)
                    CHECK(std::abs(double(s.residual) - shift) < 4);
        }
    }
}

TEST_CASE(
    "no disparity image, no depth; behind the camera and beside the image, outside; facing away, "
    "inconsistent") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform([](Vec3<double> p) { return p; });
    const Quaternion<double> still{1, 0, 0, 0};
    for (const Maker make : kMakers) {
        WarpRun run(surface);
        const auto blind = run(make, surface.rest(), nullptr);
        CHECK(count(blind, DEFREC_NO_DEPTH) + count(blind, DEFREC_OUTSIDE) == blind.size());
        CHECK(count(blind, DEFREC_NO_DEPTH) > blind.size() * 9 / 10);
        for (const auto& s : blind) CHECK(s.residual == 0);
        CHECK(count(run(make, all(surface, still, {0, 0, -300}), &surface.disparity),
                    DEFREC_OUTSIDE) == blind.size());
        CHECK(count(run(make, all(surface, still, {500, 0, 0}), &surface.disparity),
                    DEFREC_OUTSIDE) == blind.size());
        for (auto& point : run.points)
            for (float& n : point.normal) n = -n;
        const auto away = run(make, surface.rest(), &surface.disparity);
        CHECK(count(away, DEFREC_INCONSISTENT) + count(away, DEFREC_OUTSIDE) == away.size());
    }
}

TEST_CASE("motions that are not finite count as none and do not spread") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform([](Vec3<double> p) { return p; });
    auto motions = surface.rest();
    motions[3].real[1] = std::numeric_limits<float>::quiet_NaN();
    motions[17].dual[2] = std::numeric_limits<float>::infinity();
    motions[20] = {};
    for (const Maker make : kMakers) {
        const auto samples = WarpRun(surface)(make, motions, &surface.disparity);
        for (const auto& s : samples)
            for (int c = 0; c < 3; ++c) {
                CHECK(std::isfinite(s.position[c]));
                CHECK(std::isfinite(s.normal[c]));
            }
    }
}

TEST_CASE("a template with a bad index or number is refused with its place") {
    if (!under_test::available()) return;
    TestSurface surface({});
    for (const Maker make : kMakers) {
        for (int fault = 0; fault < 3; ++fault) {
            WarpRun run(surface);
            if (fault == 0) run.points[5].node[2] = int32_t(run.params.nodes);
            if (fault == 1) run.points[5].node[0] = -1;
            if (fault == 2) run.points[5].weight[1] = std::numeric_limits<float>::quiet_NaN();
            CHECK_THROWS_WITH_AS(run(make, surface.rest(), nullptr), doctest::Contains("point 5"),
                                 StageError);
        }
    }
}

TEST_CASE("warp refuses parameters out of their ranges") {
    if (!under_test::available()) return;
    TestSurface surface({});
    const auto refuses = [&](auto spoil) {
        for (const Maker make : kMakers) {
            WarpRun run(surface);
            spoil(run.params);
            CHECK_THROWS_WITH_AS(run(make, surface.rest(), nullptr), doctest::Contains("expected"),
                                 StageError);
        }
    };
    refuses([](auto& p) { p.width = 1; });
    refuses([](auto& p) { p.height = 1; });
    refuses([](auto& p) { p.stride = p.width - 1; });
    refuses([](auto& p) { p.camera.fx = 0; });
    refuses([](auto& p) { p.tolerance_mm = -1; });
}

TEST_CASE("warp agrees with the definition, with the same bits for 1, 2 and 3 threads") {
    if (!under_test::available()) return;
    for (const uint32_t width : {240u, 237u}) {
        SurfaceSpec spec;
        spec.width = width;
        TestSurface surface(spec);
        surface.deform([](Vec3<double> p) {
            return Vec3<double>{p.x + std::sin(p.y / 8), p.y, p.z + 2 * std::sin(p.x / 7)};
        });
        surface.hide([](double u, double v) { return u > 60 && u < 90 && v > 30 && v < 70; });
        std::mt19937 random(5);
        std::normal_distribution<double> some(0, 1);
        std::vector<defrec_motion> motions;
        for (size_t i = 0; i < surface.rest().size(); ++i) {
            const auto turn = rotation_from_vector(
                Vec3<double>{0.05 * some(random), 0.05 * some(random), 0.05 * some(random)});
            auto motion = from_rigid(turn, {2 * some(random), 2 * some(random), 2 * some(random)});
            if (i % 3 == 0) motion = {-1.0 * motion.real, -1.0 * motion.dual};
            motions.push_back(motion.store());
        }
        WarpRun run(surface);
        const auto expected = run(reference::make_warp, motions, &surface.disparity);
        const auto actual = run(under_test::make_warp, motions, &surface.disparity, 1);
        // On the borders between pixels and codes.
        CHECK(check_agreement(actual, expected) <= expected.size() / 500);
        for (const uint32_t threads : {2u, 3u}) {
            const auto again = run(under_test::make_warp, motions, &surface.disparity, threads);
            CHECK(std::memcmp(again.data(), actual.data(), actual.size() * sizeof(actual[0])) == 0);
        }
    }
}

TEST_CASE(
    "where rotations are far apart, the first of a point's control points decides the signs") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform([](Vec3<double> p) { return p; });
    reorder_control_points(surface);
    WarpRun run(surface);
    const auto motions = turned_apart(surface);
    const auto expected = run(reference::make_warp, motions, nullptr);
    under_test::on_every_target(
        [&] { check_agreement(run(under_test::make_warp, motions, nullptr), expected); });
}

TEST_CASE("the length of a motion's real part does not change what it does") {
    if (!under_test::available()) return;
    TestSurface surface({});
    const auto unit = turned_apart(surface);
    for (const Maker make : kMakers) {
        const auto expected = WarpRun(surface)(make, unit, nullptr);
        for (const float length : {3.0f, 1e-18f, 1e-24f, 1e-30f, 1e18f, 1e25f, 1e30f}) {
            CAPTURE(length);
            auto motions = unit;
            for (size_t i = 0; i < motions.size(); i += 2)
                for (float* part : {motions[i].real, motions[i].dual})
                    for (int c = 0; c < 4; ++c) part[c] *= length;
            check_agreement(WarpRun(surface)(make, motions, nullptr), expected);
        }
        auto none = unit, tiny = unit;
        none[5] = {};
        tiny[5] = {{1e-39f, 0, 1e-40f, 0}, {1e-39f, 1e-39f, 0, 0}};
        check_agreement(WarpRun(surface)(make, tiny, nullptr),
                        WarpRun(surface)(make, none, nullptr));
    }
}
