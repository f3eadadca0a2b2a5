// Stage lm on devices of other sizes than the one that backends/agreement meets: how many blocks
// share the work, and what of it lies in shared memory, does not show. A cluster is chosen where
// the device has them, but its blocks pass values through global memory here.
#include <doctest/doctest.h>

#include <tuple>

#include "backends/cuda/emulation/emulated_device.hpp"
#include "backends/cuda/emulation/test_device.hpp"
#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "backends/shared/test_surface.hpp"
#include "sdk/contract/stage_params.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

template <class T>
InBuffer in(const std::vector<T>& values) {
    return {values.data(), values.size() * sizeof(T)};
}

struct Solved {
    std::vector<defrec_motion> motions;
    defrec_lm_summary summary{};
};

Solved solve(const TestSurface& surface, Stage& stage) {
    const InBuffer prepared[] = {in(surface.nodes), in(surface.edges), in(surface.points),
                                 in(surface.landmarks), in(surface.patches)};
    stage.prepare(prepared);
    const std::vector<defrec_motion> start(
        surface.nodes.size() / 3,
        from_rigid(Quaternion<double>{1, 0, 0, 0}, {0.013, 0.017, 0}).store());
    Solved solved{start, {}};
    const InBuffer given[] = {in(start), in(surface.matches), in(surface.observations),
                              in(surface.disparity)};
    const OutBuffer results[] = {
        {solved.motions.data(), solved.motions.size() * sizeof(defrec_motion)},
        {&solved.summary, sizeof solved.summary}};
    stage.run(given, results);
    return solved;
}

void check_agreement(const TestSurface& surface, const Solved& actual, const Solved& expected) {
    CHECK(actual.summary.failed == 0);
    CHECK(actual.summary.iterations == expected.summary.iterations);
    CHECK(actual.summary.initial_cost ==
          doctest::Approx(expected.summary.initial_cost).epsilon(1e-4));
    CHECK(actual.summary.final_cost == doctest::Approx(expected.summary.final_cost).epsilon(1e-3));
    double farthest = 0;
    for (size_t i = 0; i < expected.motions.size(); ++i) {
        const auto node = load3<double>(&surface.nodes[3 * i]);
        const auto off = apply(DualQuaternion<double>::load(actual.motions[i]), node) -
                         apply(DualQuaternion<double>::load(expected.motions[i]), node);
        farthest = std::max(farthest, std::sqrt(dot(off, off)));
    }
    CHECK(farthest < 0.01);
}

constexpr uint32_t kKb = 1024;

}  // namespace

TEST_CASE(
    "lm gives the same surface whatever the number of blocks, within shared memory and beyond") {
    SurfaceSpec spec;
    spec.point_step = 8;
    TestSurface surface(spec);
    surface.deform([](Vec3<double> p) {
        return Vec3<double>{p.x + 0.6, p.y - 0.4, p.z + 1.5 * std::sin(p.x / 16)};
    });
    for (size_t i = 0; i < surface.matches.size(); i += 4) surface.matches[i].weight = 0;
    for (const uint32_t solver :
         {uint32_t(DEFREC_SOLVER_COUPLED), uint32_t(DEFREC_SOLVER_INDEPENDENT)}) {
        defrec_lm_params params = surface.lm_params();
        params.solver = solver;
        params.iterations = 3;
        params.presolve = 1;
        fill_defaults(params);
        const TestHost host(1);
        const Solved expected = solve(surface, *reference::make_lm(params, host.host()));
        CHECK(expected.summary.final_cost < 0.5f * expected.summary.initial_cost);
        for (const auto& [multiprocessors, shared, capability] : {std::tuple{1u, 64 * kKb, 75u},
                                                                  {3u, 64 * kKb, 75u},
                                                                  {3u, 227 * kKb, 75u},
                                                                  {13u, 64 * kKb, 75u},
                                                                  {13u, 227 * kKb, 90u},
                                                                  {20u, 227 * kKb, 90u}}) {
            CAPTURE(multiprocessors);
            CAPTURE(shared);
            CAPTURE(capability);
            cuda::EmulatedDevice device({multiprocessors, shared, shared, capability});
            check_agreement(
                surface, solve(surface, *under_test::in_host_memory(cuda::make_lm(params, device))),
                expected);
        }
    }
}

// A step that makes things worse is taken back, and the system built again where it was.
TEST_CASE("lm goes back after a step that it refuses") {
    SurfaceSpec spec;
    spec.point_step = 8;
    TestSurface surface(spec);
    const auto turn =
        from_rigid(rotation_from_vector(Vec3<double>{0, 0, 0.5}), Vec3<double>{2, -3, 1});
    surface.deform([turn](Vec3<double> p) {
        const auto q = apply(turn, p - Vec3<double>{0, 0, 80});
        return Vec3<double>{q.x, q.y, q.z + 80 + 2 * std::sin(p.x / 6)};
    });
    defrec_lm_params params = surface.lm_params();
    params.iterations = 8;
    params.damping = 0.1f;
    params.match_tukey_mm = 10;
    params.patch_tukey_px = 100;
    fill_defaults(params);
    const TestHost host(1);
    const Solved expected = solve(surface, *reference::make_lm(params, host.host()));
    CHECK(expected.summary.damping >
          10 * params.damping * float(std::pow(7.5, -expected.summary.iterations)));
    cuda::EmulatedDevice device;
    const Solved actual =
        solve(surface, *under_test::in_host_memory(cuda::make_lm(params, device)));
    CHECK(actual.summary.damping == doctest::Approx(expected.summary.damping));
    check_agreement(surface, actual, expected);
}
