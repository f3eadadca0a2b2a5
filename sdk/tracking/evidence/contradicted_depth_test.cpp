// Depth that frames contradict stays in doubt in those that agree by chance.
#include "sdk/tracking/evidence/contradicted_depth.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <vector>

using namespace defrec;

namespace {

// Vertices 0 to 2, of which the check of the last is not found.
struct Surface {
    Surface() { depth.begin(3); }
    void see(uint32_t observation, float residual) {
        defrec_surface_sample sample{};
        sample.observation = observation;
        sample.residual = residual;
        const std::vector<defrec_surface_sample> samples(depth.mm().size(), sample);
        std::vector<uint8_t> is_confirmed(samples.size(), 1);
        is_confirmed[2] = 0;
        depth.add_frame(samples, is_confirmed);
    }
    ContradictedDepth depth;
};

}  // namespace

TEST_CASE("depth that agrees in every second frame stays in doubt, noise makes none") {
    Surface crease, noise;
    for (int frame = 0; frame < 60; ++frame) {
        if (frame % 2 == 0)
            crease.see(DEFREC_INCONSISTENT, 2.5f);
        else
            crease.see(DEFREC_OBSERVED, 0.1f);
        if (frame % 20 == 0)
            noise.see(DEFREC_INCONSISTENT, 1);
        else
            noise.see(DEFREC_OBSERVED, 0.1f);
        if (frame >= 2) CHECK(crease.depth.mm()[0] > 0.5f);
        CHECK(noise.depth.mm()[0] < 0.5f);
    }
    CHECK(crease.depth.mm()[0] < 2.5f);
    for (int frame = 0; frame < 120; ++frame) crease.see(DEFREC_OBSERVED, 0.1f);
    CHECK(crease.depth.mm()[0] < 0.5f);
}

TEST_CASE("depth in front of a surface that is seen contradicts it as depth behind it does") {
    Surface behind, in_front;
    for (int frame = 0; frame < 60; ++frame) {
        behind.see(DEFREC_INCONSISTENT, 3);
        in_front.see(DEFREC_OCCLUDED, -3);
    }
    CHECK(behind.depth.mm()[0] == doctest::Approx(3).epsilon(0.01));
    CHECK(in_front.depth.mm()[0] == behind.depth.mm()[0]);
}

TEST_CASE("nothing is contradicted where the check is not found, or there is no depth") {
    Surface surface;
    surface.see(DEFREC_OCCLUDED, 5);
    const float doubt = surface.depth.mm()[1];
    CHECK(doubt > 0);
    CHECK(surface.depth.mm()[2] == 0.0f);
    surface.see(DEFREC_NO_DEPTH, 0);
    surface.see(DEFREC_OUTSIDE, 0);
    CHECK(surface.depth.mm()[1] == doubt);
}

TEST_CASE("tissue that joins brings no doubt, another template none of the last one's") {
    Surface surface;
    surface.see(DEFREC_INCONSISTENT, 4);
    const float doubt = surface.depth.mm()[0];
    CHECK(doubt > 0);
    surface.depth.grow(5);
    REQUIRE(surface.depth.mm().size() == 5);
    CHECK(surface.depth.mm()[0] == doubt);
    CHECK(surface.depth.mm()[4] == 0.0f);
    surface.depth.begin(4);
    REQUIRE(surface.depth.mm().size() == 4);
    CHECK(surface.depth.mm()[0] == 0.0f);
}
