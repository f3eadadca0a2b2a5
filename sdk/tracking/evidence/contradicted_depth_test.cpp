// Depth that frames contradict stays in doubt in those that agree by chance.
#include "sdk/tracking/evidence/contradicted_depth.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <vector>

#include "sdk/tracking/decisions/confidence.hpp"

using namespace defrec;

namespace {

constexpr float kMaxObserved = decisions::ContradictedDepth::kMaxObserved;

// Vertices 0 to 3, alike but that the check of 2 is not found, and that 3 is unknown.
struct Surface {
    Surface() { depth.begin(4); }
    void see(uint32_t observation, float residual = 0) {
        defrec_surface_sample sample{};
        sample.observation = observation;
        sample.residual = residual;
        const std::vector<defrec_surface_sample> samples(depth.doubt_mm().size(), sample);
        std::vector<uint8_t> is_confirmed(samples.size(), 1),
            status(samples.size(), DEFREC_POINT_EXTRAPOLATED);
        is_confirmed[2] = 0;
        status[3] = DEFREC_POINT_UNKNOWN;
        depth.add_frame(samples, is_confirmed, status);
    }
    // Frames that agree until the vertex may be observed again.
    int frames_in_doubt() {
        int frames = 0;
        for (; depth.doubt_mm()[0] >= kMaxObserved && frames < 1000; ++frames) see(DEFREC_OBSERVED);
        return frames;
    }
    ContradictedDepth depth;
};

}  // namespace

TEST_CASE("depth that agrees in every second frame stays in doubt") {
    Surface crease;
    for (int frame = 0; frame < 60; ++frame) {
        crease.see(DEFREC_INCONSISTENT, 2.5f);
        crease.see(DEFREC_OBSERVED, 0.1f);
        if (frame >= 2) CHECK(crease.depth.doubt_mm()[0] > kMaxObserved);
    }
    CHECK(crease.depth.doubt_mm()[0] < 2.5f);
    CHECK(crease.frames_in_doubt() < 100);
}

TEST_CASE("noise that contradicts in one frame of forty leaves most frames without doubt") {
    Surface noise;
    int doubted = 0;
    for (int frame = 0; frame < 400; ++frame) {
        if (frame % 40 == 0)
            noise.see(DEFREC_INCONSISTENT, 2.5f);
        else
            noise.see(DEFREC_OBSERVED);
        doubted += noise.depth.doubt_mm()[0] >= kMaxObserved;
    }
    CHECK(doubted < 40);
}

TEST_CASE("one contradiction says no more the farther off depth is") {
    Surface edge, farther;
    edge.see(DEFREC_OCCLUDED, -25);
    farther.see(DEFREC_OCCLUDED, -60);
    CHECK(edge.depth.doubt_mm()[0] == farther.depth.doubt_mm()[0]);
    CHECK(edge.frames_in_doubt() < 15);
}

TEST_CASE("depth in front of a surface that is seen contradicts it as depth behind it does") {
    Surface behind, in_front;
    for (int frame = 0; frame < 60; ++frame) {
        behind.see(DEFREC_INCONSISTENT, 3);
        in_front.see(DEFREC_OCCLUDED, -3);
    }
    CHECK(behind.depth.doubt_mm()[0] == doctest::Approx(3).epsilon(0.01));
    CHECK(in_front.depth.doubt_mm()[0] == behind.depth.doubt_mm()[0]);
}

TEST_CASE(
    "frames tell nothing of a vertex without its check or depth, nor of one that is unknown") {
    Surface surface;
    surface.see(DEFREC_OCCLUDED, 5);
    const float doubt = surface.depth.doubt_mm()[1];
    CHECK(doubt > 0);
    CHECK(surface.depth.doubt_mm()[2] == 0.0f);
    CHECK(surface.depth.doubt_mm()[3] == 0.0f);
    surface.see(DEFREC_NO_DEPTH);
    surface.see(DEFREC_OUTSIDE);
    CHECK(surface.depth.doubt_mm()[1] == doubt);
}

TEST_CASE("tissue that joins brings no doubt, and another template none from the last one") {
    Surface surface;
    surface.see(DEFREC_INCONSISTENT, 4);
    const float doubt = surface.depth.doubt_mm()[0];
    CHECK(doubt > 0);
    surface.depth.grow(6);
    REQUIRE(surface.depth.doubt_mm().size() == 6);
    CHECK(surface.depth.doubt_mm()[0] == doubt);
    CHECK(surface.depth.doubt_mm()[5] == 0.0f);
    surface.depth.begin(5);
    REQUIRE(surface.depth.doubt_mm().size() == 5);
    CHECK(surface.depth.doubt_mm()[0] == 0.0f);
}
