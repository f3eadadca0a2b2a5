// Stage lm: properties that hold for any backend, and agreement with the definition.
#include <doctest/doctest.h>

#include <cstring>
#include <limits>

#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "backends/shared/test_surface.hpp"
#include "sdk/contract/stage_params.hpp"
#include DEFREC_UNDER_TEST

using namespace defrec;
using namespace defrec::test;

namespace {

using Maker = std::unique_ptr<Stage> (*)(const defrec_lm_params&, const Host&);
constexpr Maker kMakers[] = {reference::make_lm, under_test::make_lm};
using Point = Vec3<double>;

template <class T>
InBuffer in(const std::vector<T>& values) {
    return {values.data(), values.size() * sizeof(T)};
}

struct Solved {
    std::vector<defrec_motion> motions;
    defrec_lm_summary summary;
};

struct LmRun {
    explicit LmRun(const TestSurface& given)
        : surface(given), params(given.lm_params()), start(given.rest()) {
        fill_defaults(params);
    }

    Solved operator()(Maker make, uint32_t threads = 1) const {
        TestHost host(threads);
        return solve(*prepared(make, host));
    }
    std::unique_ptr<Stage> prepared(Maker make, const TestHost& host) const {
        auto stage = make(params, host.host());
        const InBuffer given[] = {in(surface.nodes), in(surface.edges), in(surface.points),
                                  in(surface.landmarks), in(surface.patches)};
        stage->prepare(given);
        return stage;
    }
    Solved solve(Stage& stage) const {
        Solved solved{std::vector<defrec_motion>(params.nodes), {}};
        const InBuffer given[] = {in(start), matches ? in(surface.matches) : InBuffer{},
                                  patches ? in(surface.observations) : InBuffer{},
                                  depth ? in(surface.disparity) : InBuffer{}};
        const OutBuffer results[] = {
            {solved.motions.data(), solved.motions.size() * sizeof(defrec_motion)},
            {&solved.summary, sizeof solved.summary}};
        stage.run(std::span(given, matches || patches || depth ? 4 : 1), results);
        return solved;
    }

    TestSurface surface;
    defrec_lm_params params;
    std::vector<defrec_motion> start;
    bool matches = true, patches = true, depth = true;
};

// Distances, mm, of the template's points that the live image shows from where they should be,
// ascending.
std::vector<double> errors(
    const TestSurface& surface, const Solved& solved, const Deformation& truth,
    const std::function<bool(double, double)>& counts = [](double, double) { return true; }) {
    std::vector<double> result;
    for (const auto& point : surface.points) {
        const Point expected = truth(load3<double>(point.position));
        const auto pixel = surface.project(expected);
        if (pixel.u < 0 || pixel.v < 0 || pixel.u > surface.width() - 1 ||
            pixel.v > surface.height() - 1)
            continue;
        if (!counts(pixel.u, pixel.v)) continue;
        const Point off = TestSurface::moved(solved.motions, point) - expected;
        result.push_back(std::sqrt(dot(off, off)));
    }
    std::sort(result.begin(), result.end());
    return result;
}
double at(const std::vector<double>& sorted, double share) {
    return sorted[size_t(share * double(sorted.size() - 1))];
}

bool same(const Solved& a, const Solved& b) {
    return std::memcmp(a.motions.data(), b.motions.data(),
                       a.motions.size() * sizeof(defrec_motion)) == 0 &&
           std::memcmp(&a.summary, &b.summary, sizeof a.summary) == 0;
}
bool finite(const Solved& solved) {
    for (const auto& motion : solved.motions)
        for (int i = 0; i < 4; ++i)
            if (!std::isfinite(motion.real[i]) || !std::isfinite(motion.dual[i])) return false;
    return std::isfinite(solved.summary.final_cost);
}
bool unmoved(const Solved& solved, const std::vector<defrec_motion>& start) {
    for (size_t i = 0; i < start.size(); ++i)
        for (int c = 0; c < 4; ++c)
            if (std::abs(solved.motions[i].real[c] - start[i].real[c]) > 1e-6f ||
                std::abs(solved.motions[i].dual[c] - start[i].dual[c]) > 1e-5f)
                return false;
    return true;
}

Deformation rigid(Point turn, Point t) {
    const auto motion = from_rigid(rotation_from_vector(turn), t);
    return [motion](Point p) { return apply(motion, p - Point{0, 0, 80}) + Point{0, 0, 80}; };
}
// A wave across the surface with some sideways motion: not one that control points can follow
// exactly.
Point wave(Point p) {
    return {p.x + 0.8 * std::sin(p.y / 12) + 0.5, p.y + 0.5 * std::cos(p.x / 14),
            p.z + 1.5 * std::sin(p.x / 16 + p.y / 18)};
}

// A small motion of a control point that differs from its neighbours', so that connections cost
// something from the start.
defrec_motion apart(Point node, double seed) {
    const auto turn =
        rotation_from_vector(Point{0.02 * std::sin(seed), 0.02 * std::cos(2 * seed), 0.01});
    const Point shift{0.013 + 0.1 * std::sin(3 * seed), 0.017, 0.1 * std::cos(seed)};
    return from_rigid(turn, node + shift - rotate(turn, node)).store();
}

// docs/numerics.md
void check_agreement(const TestSurface& surface, const Solved& actual, const Solved& expected) {
    CHECK(actual.summary.failed == expected.summary.failed);
    CHECK(actual.summary.initial_cost ==
          doctest::Approx(expected.summary.initial_cost).epsilon(2e-3));
    CHECK(actual.summary.final_cost == doctest::Approx(expected.summary.final_cost).epsilon(2e-3));
    CHECK(std::abs(actual.summary.icp_points - expected.summary.icp_points) <= 8);
    CHECK(std::abs(actual.summary.matches - expected.summary.matches) <= 2);
    CHECK(std::abs(actual.summary.patches - expected.summary.patches) <= 2);
    REQUIRE(actual.motions.size() == expected.motions.size());
    double farthest = 0, max_turned = 0;
    for (size_t i = 0; i < expected.motions.size(); ++i) {
        const auto a = DualQuaternion<double>::load(actual.motions[i]),
                   e = DualQuaternion<double>::load(expected.motions[i]);
        const auto node = load3<double>(&surface.nodes[3 * i]);
        const Point off = apply(a, node) - apply(e, node);
        farthest = std::max(farthest, std::sqrt(dot(off, off)));
        const auto turn = a.real - e.real;
        max_turned = std::max(max_turned, 2 * std::sqrt(dot(turn, turn)));
    }
    CHECK(farthest < 0.02);
    CHECK(max_turned < 0.005);
}

}  // namespace

TEST_CASE("a rigid motion is recovered, with and without moving everything rigidly first") {
    if (!under_test::available()) return;
    const auto truth = rigid({0.05, -0.08, 0.06}, {3, -2, 2});
    TestSurface surface({});
    surface.deform(truth);
    for (const Maker make : kMakers)
        for (const uint32_t first : {0u, 1u}) {
            LmRun run(surface);
            run.params.presolve = first;
            const Solved solved = run(make);
            CHECK(solved.summary.failed == 0);
            CHECK(solved.summary.final_cost < solved.summary.initial_cost);
            CHECK(at(errors(surface, solved, truth), 1) <
                  0.15);  // disparities are rounded to 0.35 mm of depth
            CHECK(solved.summary.match_rms < 0.05f);
        }
}

TEST_CASE("a far rigid motion, beyond every kernel, is reached by moving rigidly first") {
    if (!under_test::available()) return;
    const auto truth = rigid({0.1, 0.2, -0.6}, {8, -6, 10});
    TestSurface surface({});
    surface.deform(truth);
    for (size_t i = 0; i < surface.matches.size(); i += 5)
        surface.matches[i].position[0] += 25;  // outliers
    for (const Maker make : kMakers) {
        LmRun run(surface);
        run.params.presolve = 1;
        CHECK(at(errors(surface, run(make), truth), 0.95) < 0.2);
    }
}

TEST_CASE("a smooth deformation is recovered") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    for (const Maker make : kMakers) {
        const Solved solved = LmRun(surface)(make);
        const auto off = errors(surface, solved, wave);
        CHECK(at(off, 0.5) < 0.15);
        CHECK(at(off, 0.95) < 0.5);
    }
}

TEST_CASE("matches, patches or depth alone say what they can") {
    if (!under_test::available()) return;
    TestSurface surface({});
    const auto truth = rigid({0, 0, 0}, {1.5, -1, 1});
    surface.deform(truth);
    for (const Maker make : kMakers) {
        LmRun only_matches(surface), only_patches(surface), only_depth(surface);
        only_matches.patches = only_matches.depth = false;
        CHECK(at(errors(surface, only_matches(make), truth), 0.95) < 0.05);
        CHECK(only_matches(make).summary.icp_points == 0);
        only_patches.matches = only_patches.depth = false;
        const Solved seen = only_patches(make);
        CHECK(seen.summary.patches == 120);
        CHECK(seen.summary.patch_rms < 0.1f);
        only_depth.matches = only_depth.patches = false;
        CHECK(only_depth(make).summary.icp_rms < 0.3f);
    }
}

TEST_CASE("without any data motions stay as they are") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    for (const Maker make : kMakers) {
        LmRun run(surface);
        run.matches = run.patches = run.depth = false;
        run.start[5] = from_rigid(rotation_from_vector(Point{0.1, 0, 0}), {1, 2, 3}).store();
        const Solved nothing = run(make);
        CHECK(nothing.summary.failed == 0);
        CHECK(nothing.summary.iterations == 0);
        CHECK(unmoved(nothing, run.start));

        LmRun outside(surface);  // everything beside the image, and no match or patch
        outside.matches = outside.patches = false;
        for (auto& motion : outside.start)
            motion = from_rigid(Quaternion<double>{1, 0, 0, 0}, {900, 0, 0}).store();
        CHECK(unmoved(outside(make), outside.start));
    }
}

TEST_CASE("starting from everything translated gives the same surface") {
    if (!under_test::available()) return;
    // Matches alone: the other terms look through the camera.
    TestSurface surface({});
    surface.deform(wave);
    for (const Maker make : kMakers) {
        LmRun run(surface);
        run.patches = run.depth = false;
        run.params.match_tukey_mm = 50;
        const Solved first = run(make);
        auto moved_start = run;
        for (auto& motion : moved_start.start)
            motion = from_rigid(Quaternion<double>{1, 0, 0, 0}, {2, -3, 1}).store();
        const Solved second = moved_start(make);
        for (const auto& point : surface.points) {
            const Point off = TestSurface::moved(first.motions, point) -
                              TestSurface::moved(second.motions, point);
            CHECK(std::sqrt(dot(off, off)) < 0.1);
        }
    }
}

TEST_CASE(
    "an occluded half follows its neighbours, and faster when control points are solved together") {
    if (!under_test::available()) return;
    const auto truth = rigid({0, 0, 0}, {7, 7, 2});
    TestSurface surface({});
    surface.deform(truth);
    const auto hidden = [](double u, double) { return u < 120; };
    surface.hide(hidden);
    for (const Maker make : kMakers) {
        LmRun run(surface);
        run.params.match_tukey_mm = 30;
        run.params.patch_tukey_px = 200;
        run.params.iterations = 10;
        const Solved coupled = run(make);
        run.params.solver = DEFREC_SOLVER_INDEPENDENT;
        const Solved independent = run(make);
        CHECK(coupled.summary.final_cost < independent.summary.final_cost);
        const double together = at(errors(surface, coupled, truth, hidden), 0.95),
                     apart = at(errors(surface, independent, truth, hidden), 0.95);
        CHECK(together < 1.0);
        CHECK(apart > 2 * together);
    }
}

TEST_CASE("matches that preselection left out count by their distance, and outliers do not pull") {
    if (!under_test::available()) return;
    TestSurface surface({});
    const auto truth = rigid({0, 0, 0}, {1, 1, 0.5});
    surface.deform(truth);
    for (size_t i = 0; i < surface.matches.size(); ++i) {
        surface.matches[i].weight = 0;
        if (i % 3 == 0) surface.matches[i].position[1] += 20;
    }
    for (const Maker make : kMakers) {
        LmRun run(surface);
        run.patches = run.depth = false;
        const Solved solved = run(make);
        CHECK(at(errors(surface, solved, truth), 0.95) < 0.1);
        CHECK(solved.summary.matches <= 200 * 2 / 3 + 1);
    }
}

TEST_CASE("a frame of nothing but outliers moves nothing, whatever the kernels' widths") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    for (auto& match : surface.matches) match.position[0] += 60;
    for (auto& observation : surface.observations) observation.u += 256 * 200;
    for (const Maker make : kMakers)
        for (float width = 0.9f; width < 15; width *= 1.31f) {
            LmRun run(surface);
            run.depth = false;
            run.params.match_tukey_mm = run.params.patch_tukey_px = width;
            run.params.match_threshold_mm = 1.37f * width;
            for (size_t i = 0; i < surface.matches.size(); ++i)
                run.surface.matches[i].weight = i % 2 ? 0.0f : 1.0f;
            const auto check = [&](const Solved& solved) {
                CHECK(solved.summary.iterations == 0);
                CHECK(solved.summary.matches == 0);
                CHECK(solved.summary.patches == 0);
                CHECK(solved.summary.match_rms == 0);
                CHECK(solved.summary.final_cost > 0);
                for (size_t i = 0; i < run.start.size(); ++i)
                    for (int c = 0; c < 4; ++c) {
                        CHECK(solved.motions[i].real[c] == run.start[i].real[c]);
                        CHECK(solved.motions[i].dual[c] == run.start[i].dual[c]);
                    }
            };
            under_test::on_every_target([&] { check(run(make)); });
        }
}

TEST_CASE("a match with next to no depth pulls nothing, and the others go on") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    for (const float depth : {1e-38f, 1e-37f, 1e-30f, 1e-10f}) {
        CAPTURE(depth);
        LmRun run(surface);
        for (size_t i = 0; i < run.start.size(); ++i)
            run.start[i] = apart(load3<double>(&surface.nodes[3 * i]), double(i));
        for (const size_t i : {3, 4}) {
            run.surface.matches[i] = {};
            run.surface.matches[i].position[0] = 10;
            run.surface.matches[i].position[1] = 5;
            run.surface.matches[i].position[2] = depth;
            run.surface.matches[i].weight = i == 3 ? 1.0f : 0.0f;
        }
        const Solved expected = run(reference::make_lm), actual = run(under_test::make_lm);
        check_agreement(surface, actual, expected);
        CHECK(actual.summary.failed == 0);
        CHECK(finite(actual));
        CHECK(at(errors(surface, actual, wave), 0.5) < 0.15);
    }
}

TEST_CASE("numbers that are not finite in a frame are left out and do not spread") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                inf = std::numeric_limits<float>::infinity();
    surface.matches[3].position[0] = nan;
    surface.matches[4].position[2] = inf;
    surface.matches[5].weight = nan;
    surface.observations[2].information[1] = nan;
    surface.observations[3].information[0] = inf;
    surface.observations[4].information[0] = -1;
    for (const Maker make : kMakers) {
        LmRun run(surface);
        run.params.presolve = 1;
        run.start[7].real[2] = nan;
        run.start[8].dual[0] = inf;
        run.start[9] = {};
        const Solved solved = run(make);
        CHECK(solved.summary.failed == 0);
        CHECK(finite(solved));
        CHECK(at(errors(surface, solved, wave), 0.5) < 0.3);
    }
}

TEST_CASE("a system that cannot be solved leaves the motions as given and says so") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    // What single precision does not hold; the reference's double precision does.
    LmRun run(surface);
    run.params.arap_weight = run.params.rotation_weight = std::numeric_limits<float>::max();
    const Solved solved = run(under_test::make_lm);
    CHECK(solved.summary.failed == 1);
    CHECK(unmoved(solved, run.start));
}

TEST_CASE("control points without any connection or data stay, the others move") {
    if (!under_test::available()) return;
    TestSurface surface({});
    const auto truth = rigid({0, 0, 0}, {1, 0, 0});
    surface.deform(truth);
    const auto lonely = int32_t(surface.nodes.size() / 3);
    for (const float value : {500.0f, 500.0f, 500.0f}) surface.nodes.push_back(value);
    for (const Maker make : kMakers) {
        const Solved solved = LmRun(surface)(make);
        CHECK(solved.summary.failed == 0);
        CHECK(at(errors(surface, solved, truth), 0.95) < 0.15);
        CHECK(std::abs(solved.motions[size_t(lonely)].dual[1]) < 1e-6f);
    }
}

TEST_CASE("an edge named twice or backwards counts as one with both weights") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    TestSurface split = surface;
    split.edges.clear();
    for (const defrec_edge& edge : surface.edges) {
        split.edges.push_back({edge.a, edge.b, edge.weight / 4});
        split.edges.push_back({edge.b, edge.a, edge.weight * 3 / 4});
    }
    for (const Maker make : kMakers) {
        const Solved expected = LmRun(surface)(make), actual = LmRun(split)(make);
        CHECK(actual.summary.final_cost ==
              doctest::Approx(expected.summary.final_cost).epsilon(1e-4));
        CHECK(actual.summary.arap_cost ==
              doctest::Approx(expected.summary.arap_cost).epsilon(1e-3));
    }
}

TEST_CASE("a trusted last step is taken whatever it costs, but not after a refused one") {
    if (!under_test::available()) return;
    // Patches lead to where the image shows no surface, which costs more than they gain.
    TestSurface surface({});
    surface.deform(rigid({0, 0, 0}, {0, 0, 0}));
    for (auto& observation : surface.observations) observation.u += 256 * 60;
    for (const Maker make : kMakers) {
        LmRun run(surface);
        run.matches = false;
        run.params.patch_tukey_px = 1000;
        run.params.icp_weight = 300;
        run.params.iterations = 1;
        CHECK(unmoved(run(make), run.start));
        run.params.trust_last_step = 1;
        const Solved trusted = run(make);
        CHECK_FALSE(unmoved(trusted, run.start));
        CHECK(trusted.summary.iterations == 1);
        CHECK(trusted.summary.failed == 0);
        CHECK(trusted.summary.final_cost == trusted.summary.initial_cost);
        CHECK(trusted.summary.damping < run.params.damping);
        run.params.iterations = 2;
        const Solved refused = run(make);
        CHECK(unmoved(refused, run.start));
        CHECK(refused.summary.iterations == 1);
        CHECK(refused.summary.damping > run.params.damping);
    }
}

TEST_CASE("a trusted step from the minimum moves nothing, and has not failed") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(rigid({0, 0, 0}, {0, 0, 0}));
    // Nothing is left of the gradient: without connections, and with one match, on the axis, where
    // rounding leaves no residual.
    surface.edges.clear();
    for (defrec_match& match : surface.matches) match = {};
    surface.matches[0].weight = 1;
    for (float* position : {surface.landmarks[0].position, surface.matches[0].position}) {
        position[0] = position[1] = 0;
        position[2] = 80;
    }
    for (const Maker make : kMakers)
        for (const uint32_t steps : {1u, 2u, 7u}) {
            LmRun run(surface);
            run.patches = run.depth = false;
            run.params.iterations = 1;
            run.params.trust_last_step = 1;
            run.params.cg_iterations = steps;
            const Solved solved = run(make);
            CHECK(solved.summary.failed == 0);
            CHECK(solved.summary.iterations == 1);
            CHECK(unmoved(solved, run.start));
        }
}

TEST_CASE("a step that lowers the cost is the same, trusted or not") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    for (const Maker make : kMakers)
        for (const auto& [iterations, solver] :
             {std::pair(1u, DEFREC_SOLVER_COUPLED), std::pair(2u, DEFREC_SOLVER_COUPLED),
              std::pair(2u, DEFREC_SOLVER_INDEPENDENT)}) {
            LmRun run(surface);
            run.params.iterations = iterations;
            run.params.solver = solver;
            const Solved evaluated = run(make);
            run.params.trust_last_step = 1;
            const Solved trusted = run(make);
            CHECK(unmoved(trusted, evaluated.motions));
            CHECK(trusted.summary.final_cost > evaluated.summary.final_cost);
        }
}

TEST_CASE("lm refuses parameters out of their ranges") {
    if (!under_test::available()) return;
    TestSurface surface({});
    const auto refuses = [&](auto spoil) {
        for (const Maker make : kMakers) {
            LmRun run(surface);
            spoil(run.params);
            CHECK_THROWS_WITH_AS(run(make), doctest::Contains("expected"), StageError);
        }
    };
    refuses([](auto& p) { p.solver = 3; });
    refuses([](auto& p) { p.width = 1; });
    refuses([](auto& p) { p.stride = p.width - 1; });
    refuses([](auto& p) { p.camera.baseline_mm = 0; });
    refuses([](auto& p) { p.iterations = 0; });
    refuses([](auto& p) { p.arap_weight = std::numeric_limits<float>::infinity(); });
    refuses([](auto& p) { p.trust_last_step = 2; });
}

TEST_CASE("a template that cannot be used is refused") {
    if (!under_test::available()) return;
    for (const Maker make : kMakers)
        for (int fault = 0; fault < 6; ++fault) {
            TestSurface surface({});
            surface.deform(wave);
            if (fault == 0) surface.nodes[4] = std::numeric_limits<float>::quiet_NaN();
            if (fault == 1) surface.edges[2].b = int32_t(surface.nodes.size() / 3);
            if (fault == 2) surface.edges[2].a = surface.edges[2].b;
            if (fault == 3) surface.edges[2].weight = 0;
            if (fault == 4) surface.landmarks[1].node[3] = -1;
            if (fault == 5) surface.points[1].normal[0] = std::numeric_limits<float>::infinity();
            const LmRun run(surface);
            CHECK_THROWS_AS(run(make), StageError);
        }
}

TEST_CASE("lm agrees with the definition, and gives the same bits again, for 1, 2 and 3 threads") {
    if (!under_test::available()) return;
    for (const uint32_t solver :
         {uint32_t(DEFREC_SOLVER_COUPLED), uint32_t(DEFREC_SOLVER_INDEPENDENT)})
        for (const uint32_t width : {240u, 213u}) {
            SurfaceSpec spec;
            spec.width = width;
            TestSurface surface(spec);
            surface.deform(wave);
            surface.hide([](double u, double v) { return u > 50 && u < 110 && v < 80; });
            for (size_t i = 0; i < surface.matches.size(); i += 4) surface.matches[i].weight = 0;
            for (size_t i = 0; i < surface.observations.size(); ++i)
                surface.observations[i].information[1] = float(i % 5) * 0.1f;
            // The same point by control points in another order, one of them twice.
            auto& point = surface.points[100];
            std::swap(point.node[0], point.node[3]);
            std::swap(point.weight[0], point.weight[3]);
            point.node[1] = point.node[2];

            LmRun run(surface);
            run.params.solver = solver;
            run.params.iterations = 5;
            for (size_t i = 0; i < run.start.size(); ++i)
                run.start[i] = apart(load3<double>(&surface.nodes[3 * i]), double(i));
            const Solved expected = run(reference::make_lm), actual = run(under_test::make_lm);
            check_agreement(surface, actual, expected);
            for (const uint32_t threads : {1u, 2u, 3u})
                CHECK(same(run(under_test::make_lm, threads), actual));
        }
}

TEST_CASE(
    "lm agrees with the definition where control points are many, and where templates lack "
    "something") {
    if (!under_test::available()) return;
    enum { kDense, kNoEdges, kNoPoints, kNoSightings, kOneControlPoint, kCases };
    for (int which = 0; which < kCases; ++which) {
        CAPTURE(which);
        SurfaceSpec spec;
        if (which == kDense) spec.node_step = 5;
        if (which == kDense) spec.connection = 1.5;
        TestSurface surface(spec);
        surface.deform(rigid({0.01, -0.02, 0.01}, {0.6, -0.4, 0.5}));
        if (which == kNoEdges) surface.edges.clear();
        if (which == kNoPoints) surface.points.clear();
        if (which == kNoSightings) {
            surface.landmarks.clear();
            surface.patches.clear();
            surface.matches.clear();
            surface.observations.clear();
        }
        if (which == kOneControlPoint) {
            surface.nodes.resize(3);
            surface.edges.clear();
            const auto bind = [](auto& items) {
                for (auto& item : items) {
                    std::fill(item.node, item.node + DEFREC_BLEND_NODES, 0);
                    const float all_of_first[DEFREC_BLEND_NODES] = {1};
                    std::copy(all_of_first, all_of_first + DEFREC_BLEND_NODES, item.weight);
                }
            };
            bind(surface.points);
            bind(surface.landmarks);
            bind(surface.patches);
        }
        LmRun run(surface);
        run.params.iterations = 3;
        run.params.cg_iterations = 7;
        for (auto& motion : run.start)
            motion = from_rigid(Quaternion<double>{1, 0, 0, 0}, {0.013, 0.017, 0}).store();
        const Solved expected = run(reference::make_lm), actual = run(under_test::make_lm);
        CHECK(expected.summary.final_cost < expected.summary.initial_cost);
        check_agreement(surface, actual, expected);
        if (which == kDense) CHECK(same(run(under_test::make_lm, 3), actual));
        CHECK(actual.summary.iterations == expected.summary.iterations);
        CHECK(actual.summary.damping == doctest::Approx(expected.summary.damping));
    }
}

TEST_CASE(
    "where rotations are far apart, the first of a point's control points decides the signs") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    reorder_control_points(surface);
    LmRun run(surface);
    run.start = turned_apart(surface);
    run.depth = false;
    run.params.match_tukey_mm = 200;
    run.params.patch_tukey_px = 2000;
    run.params.iterations = 1;
    const Solved expected = run(reference::make_lm);
    under_test::on_every_target(
        [&] { check_agreement(surface, run(under_test::make_lm), expected); });
}

TEST_CASE("a frame does not depend on those before it") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    LmRun run(surface);
    run.params.presolve = 1;
    TestHost host(1);
    const auto stage = run.prepared(under_test::make_lm, host);
    const Solved first = run.solve(*stage);
    LmRun other = run;
    other.surface.deform(rigid({0.05, -0.08, 0.06}, {3, -2, 2}));
    other.patches = false;
    CHECK_FALSE(same(other.solve(*stage), first));
    other.matches = other.depth = false;
    CHECK(other.solve(*stage).summary.iterations == 0);
    CHECK(same(run.solve(*stage), first));
}

TEST_CASE("row 93: a template that is refused leaves the one before") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform(wave);
    const LmRun run(surface);
    TestHost host(1);
    const auto stage = run.prepared(under_test::make_lm, host);
    const Solved first = run.solve(*stage);
    std::vector<defrec_edge> wrong = surface.edges;
    wrong[2].b = int32_t(surface.nodes.size() / 3);
    const InBuffer given[] = {in(surface.nodes), in(wrong), in(surface.points),
                              in(surface.landmarks), in(surface.patches)};
    CHECK_THROWS_AS(stage->prepare(given), StageError);
    CHECK(same(run.solve(*stage), first));
}
