// Given disparity against patches that were found in both views; what these show is made up.
#include "sdk/tracking/monitors/disparity_check.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "sdk/tracking/decisions/disparity.hpp"

using namespace defrec;
using Decision = decisions::GivenDisparity;

namespace {

constexpr int kSide = 128, kPatches = 64, kDisparity = 20;

// Patches in rows of eight, each where the right view shows it kDisparity px further left.
struct Frame {
    TemplateData data;
    std::vector<int16_t> disparity =
        std::vector<int16_t>(kSide * kSide, kDisparity* DEFREC_DISPARITY_ONE);
    std::vector<defrec_patch_observation> left{kPatches}, right{kPatches};

    Frame() {
        data.width = data.height = kSide;
        data.patches.resize(kPatches);
        for (int i = 0; i < kPatches; ++i) {
            const auto at = static_cast<size_t>(i);
            left[at].valid = right[at].valid = 1;
            left[at].u = 256 * (24 + 12 * (i % 8));
            left[at].v = right[at].v = 256 * (12 + 12 * (i / 8));
            right[at].u = left[at].u - 256 * kDisparity;
        }
    }
    DisparityCheck check(float sigma_px = 0.1f) const {
        FrameOutput output;
        auto observations = left, in_right = right;
        output.observations = observations;
        output.right_observations = in_right;
        return check_disparity(data, output, {disparity.data(), nullptr, sigma_px});
    }
    void shift(double px) {
        for (int16_t& value : disparity)
            value = static_cast<int16_t>(value + px * double{DEFREC_DISPARITY_ONE});
    }
};

}  // namespace

TEST_CASE("disparity that both views show agrees; one that is off by more is told, with its size") {
    Frame frame;
    REQUIRE(rig_patch_step(frame.data) == 1);
    CHECK_FALSE(frame.check().disagrees);
    CHECK(frame.check().error_px == 0);
    frame.shift(Decision::kMinError - 0.25);
    CHECK_FALSE(frame.check().disagrees);
    for (const double px : {2.0, -6.0}) {
        Frame off;
        off.shift(px);
        CHECK(off.check().disagrees);
        CHECK(off.check().error_px == doctest::Approx(Decision::kDeviation * std::abs(px)));
    }
}

TEST_CASE("what lies within the stated error is no disagreement") {
    Frame frame;
    frame.shift(3);
    CHECK(frame.check(1.4f).disagrees);
    CHECK_FALSE(frame.check(1.6f).disagrees);
}

TEST_CASE("noise of single pixels, and holes, do not make it disagree") {
    Frame frame;
    for (size_t i = 0; i < frame.disparity.size(); ++i) {
        if (i % 3 == 0) frame.disparity[i] = DEFREC_DISPARITY_NONE;
        if (i % 3 == 1) frame.disparity[i] += 2 * DEFREC_DISPARITY_ONE;
        if (i % 3 == 2) frame.disparity[i] -= 2 * DEFREC_DISPARITY_ONE;
    }
    CHECK_FALSE(frame.check().disagrees);
    // A part that is wrong, as of an instrument, does not outvote the rest.
    for (size_t i = 0; i < frame.disparity.size() / 3; ++i)
        frame.disparity[i] = 40 * DEFREC_DISPARITY_ONE;
    CHECK_FALSE(frame.check().disagrees);
}

TEST_CASE(
    "patches that the right view does not show near tell of a gross error, few tell nothing") {
    Frame frame;
    for (defrec_patch_observation& patch : frame.right) patch.valid = 0;
    CHECK(frame.check().disagrees);
    CHECK(frame.check().error_px == Decision::kUnfoundError);
    for (size_t i = Decision::kMinPatches - 1; i < kPatches; ++i) frame.left[i].valid = 0;
    CHECK_FALSE(frame.check().disagrees);
    // Nor does a frame whose disparity has holes at nearly all of them.
    Frame holes;
    holes.shift(5);
    for (size_t i = kSide * 30; i < holes.disparity.size(); ++i)
        holes.disparity[i] = DEFREC_DISPARITY_NONE;
    CHECK_FALSE(holes.check().disagrees);
}

TEST_CASE("patches that the right view does not show count against those that agree") {
    // The right ones of each row: those at the left would lie outside of the right view.
    const auto with_unfound = [](int columns) {
        Frame frame;
        for (int i = 0; i < kPatches; ++i)
            if (i % 8 >= 8 - columns) frame.right[static_cast<size_t>(i)].valid = 0;
        return frame.check();
    };
    CHECK_FALSE(with_unfound(3).disagrees);
    CHECK(with_unfound(5).disagrees);
    CHECK(with_unfound(5).error_px == Decision::kUnfoundError);
    CHECK(with_unfound(5).is_by_unfound);
    Frame outside;
    for (int i = 0; i < kPatches; ++i) {
        const auto at = static_cast<size_t>(i);
        if (i % 8 >= 5) continue;
        outside.left[at].u = 256 * (kDisparity + i % 8);
        outside.right[at].valid = 0;
    }
    CHECK_FALSE(outside.check().disagrees);
}

TEST_CASE("patches at the border of the image are compared with what of it there is") {
    Frame frame;
    for (size_t i = 0; i < kPatches; ++i) {
        frame.left[i].u = i % 2 == 0 ? 0 : 256 * (kSide - 1) + 100;
        frame.left[i].v = i % 4 < 2 ? -100 : 256 * (kSide - 1) + 100;
        frame.right[i].u = frame.left[i].u - 256 * kDisparity;
    }
    CHECK_FALSE(frame.check().disagrees);
    frame.shift(4);
    CHECK(frame.check().disagrees);
}
