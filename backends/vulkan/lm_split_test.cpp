// Stage lm computes the same however many invocations share a block: what discrete devices run, on whatever device there is.
#include "backends/vulkan/lm.hpp"

#include <doctest/doctest.h>

#include "backends/shared/stage_defaults_lm.hpp"
#include "backends/shared/test_surface.hpp"
#include "backends/vulkan/test_device.hpp"

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

Solved solve(const TestSurface& surface, const defrec_lm_params& params, uint32_t split) {
    const auto stage = under_test::in_host_memory(vulkan::make_lm(params, under_test::device(), split));
    const InBuffer prepared[] = {in(surface.nodes), in(surface.edges), in(surface.points), in(surface.landmarks), in(surface.patches)};
    stage->prepare(prepared);
    const std::vector<defrec_motion> start = surface.rest();
    Solved solved{start, {}};
    const InBuffer given[] = {in(start), in(surface.matches), in(surface.observations), in(surface.disparity)};
    const OutBuffer results[] = {{solved.motions.data(), solved.motions.size() * sizeof(defrec_motion)},
                                 {&solved.summary, sizeof solved.summary}};
    stage->run(given, results);
    return solved;
}

}  // namespace

TEST_CASE("lm computes the same by one, two, and eight invocations for each block") {
    if (!under_test::available()) return;
    TestSurface surface({});
    surface.deform([](Vec3<double> p) { return Vec3<double>{p.x + 0.6, p.y - 0.4, p.z + 1.5 * std::sin(p.x / 16)}; });
    for (const uint32_t solver : {uint32_t(DEFREC_SOLVER_COUPLED), uint32_t(DEFREC_SOLVER_INDEPENDENT)}) {
        defrec_lm_params params = surface.lm_params();
        params.solver = solver;
        params.iterations = 3;
        fill_defaults(params);
        const Solved expected = solve(surface, params, 1);
        CHECK(expected.summary.final_cost < 0.5f * expected.summary.initial_cost);
        for (const uint32_t split : {2u, 8u}) {
            CAPTURE(split);
            const Solved actual = solve(surface, params, split);
            CHECK(actual.summary.final_cost == doctest::Approx(expected.summary.final_cost).epsilon(1e-4));
            CHECK(actual.summary.iterations == expected.summary.iterations);
            for (size_t i = 0; i < actual.motions.size(); ++i)
                for (int c = 0; c < 4; ++c) {
                    CHECK(std::abs(actual.motions[i].real[c] - expected.motions[i].real[c]) < 1e-4f);
                    CHECK(std::abs(actual.motions[i].dual[c] - expected.motions[i].dual[c]) < 1e-2f);
                }
        }
    }
}
