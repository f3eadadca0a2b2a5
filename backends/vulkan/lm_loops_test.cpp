// Stage lm on a device, beside what backends/agreement holds: what discrete devices run, on
// whatever device there is, and long loops.
#include <doctest/doctest.h>

#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "backends/shared/test_surface.hpp"
#include "backends/vulkan/lm.hpp"
#include "backends/vulkan/test_device.hpp"
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

Solved solve(const TestSurface& surface, const std::unique_ptr<Stage>& stage) {
    const InBuffer prepared[] = {in(surface.nodes), in(surface.edges), in(surface.points),
                                 in(surface.landmarks), in(surface.patches)};
    stage->prepare(prepared);
    const std::vector<defrec_motion> start = surface.rest();
    Solved solved{start, {}};
    const InBuffer given[] = {in(start), in(surface.matches), in(surface.observations),
                              in(surface.disparity)};
    const OutBuffer results[] = {
        {solved.motions.data(), solved.motions.size() * sizeof(defrec_motion)},
        {&solved.summary, sizeof solved.summary}};
    stage->run(given, results);
    return solved;
}

std::unique_ptr<Stage> make(const defrec_lm_params& params, const vulkan::LmSplits& splits) {
    return under_test::in_host_memory(vulkan::make_lm(params, under_test::device(), splits));
}

// Everything moved by the first control point.
TestSurface one_control_point(double point_step) {
    SurfaceSpec spec;
    spec.point_step = point_step;
    TestSurface surface(spec);
    surface.deform([](Vec3<double> p) { return Vec3<double>{p.x + 0.6, p.y - 0.4, p.z + 1.5}; });
    surface.nodes.resize(3);
    surface.edges.clear();
    const auto bind = [](auto& items) {
        for (auto& item : items)
            for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
                item.node[k] = 0;
                item.weight[k] = k == 0 ? 1.0f : 0.0f;
            }
    };
    bind(surface.points);
    bind(surface.landmarks);
    bind(surface.patches);
    return surface;
}

}  // namespace

TEST_CASE("lm computes the same by one and by several invocations for each block") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform([](Vec3<double> p) {
        return Vec3<double>{p.x + 0.6, p.y - 0.4, p.z + 1.5 * std::sin(p.x / 16)};
    });
    for (const uint32_t solver :
         {uint32_t(DEFREC_SOLVER_COUPLED), uint32_t(DEFREC_SOLVER_INDEPENDENT)}) {
        defrec_lm_params params = surface.lm_params();
        params.solver = solver;
        params.iterations = 3;
        fill_defaults(params);
        const Solved expected = solve(surface, make(params, {}));
        CHECK(expected.summary.final_cost < 0.5f * expected.summary.initial_cost);
        for (const vulkan::LmSplits& splits : {vulkan::LmSplits{4, 2, 4, 8}, vulkan::kGpuSplits}) {
            CAPTURE(splits.data);
            CAPTURE(splits.own);
            const Solved actual = solve(surface, make(params, splits));
            CHECK(actual.summary.final_cost ==
                  doctest::Approx(expected.summary.final_cost).epsilon(1e-4));
            CHECK(actual.summary.iterations == expected.summary.iterations);
            for (size_t i = 0; i < actual.motions.size(); ++i)
                for (int c = 0; c < 4; ++c) {
                    CHECK(std::abs(actual.motions[i].real[c] - expected.motions[i].real[c]) <
                          1e-4f);
                    CHECK(std::abs(actual.motions[i].dual[c] - expected.motions[i].dual[c]) <
                          1e-2f);
                }
        }
    }
}

// lavapipe would silently leave out what comes after 65,535 rounds.
TEST_CASE("lm sums all residuals of a control point that has very many, and refuses too many") {
    if (!under_test::available()) return;
    const TestSurface surface = one_control_point(0.82);
    CHECK(surface.points.size() > 48000);
    defrec_lm_params params = surface.lm_params();
    params.iterations = 1;
    fill_defaults(params);
    const TestHost host(1);
    const Solved expected = solve(surface, reference::make_lm(params, host.host())),
                 actual = solve(surface, make(params, {}));
    CHECK(actual.summary.final_cost == doctest::Approx(expected.summary.final_cost).epsilon(1e-3));
    for (int c = 0; c < 4; ++c) {
        CHECK(std::abs(actual.motions[0].real[c] - expected.motions[0].real[c]) < 1e-5f);
        CHECK(std::abs(actual.motions[0].dual[c] - expected.motions[0].dual[c]) < 1e-3f);
    }

    const TestSurface larger = one_control_point(0.8);
    params = larger.lm_params();
    fill_defaults(params);
    try {
        solve(larger, make(params, {}));
        FAIL("not refused");
    } catch (const StageError& error) {
        CHECK(error.status() == DEFREC_ERROR_UNSUPPORTED);
    }
}
