// The numbers of templates, of which an application hears only those that frames gave.
#include "sdk/tracking/tracked_surface.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "sdk/template/test_capture.hpp"

namespace {

using namespace defrec;
using Source = TrackedSurface::Source;

// A plane.
TrackedSurface::Next plane() {
    constexpr uint32_t kWidth = 160, kHeight = 120;
    const std::vector<uint8_t> gray(kWidth * kHeight, 128), mask(kWidth * kHeight, 255);
    const std::vector<int16_t> disparity(kWidth * kHeight, 16 * 20);
    auto data = capture_template(
        test::capture_input(kWidth, kHeight, {160, 160, 80, 60, 5, 0}, gray, mask, disparity));
    return TrackedSurface::Next(std::make_shared<const Template>(std::move(data.value())));
}

void check_numbers(const TrackedSurface& surface, uint32_t epoch, uint32_t template_epoch) {
    CHECK(surface.epoch() == epoch);
    CHECK(surface.template_epoch() == template_epoch);
}

}  // namespace

TEST_CASE("each template has a number, and a changed one another number of its own") {
    TrackedSurface surface(false);
    check_numbers(surface, 0, 0);
    surface.adopt(plane(), Source::kCaptured);
    check_numbers(surface, 1, 1);
    surface.change(plane());
    check_numbers(surface, 1, 2);
    surface.adopt(plane(), Source::kGiven);
    check_numbers(surface, 2, 3);
}

TEST_CASE("depth that was contradicted stays so in a changed template, and in no other") {
    TrackedSurface surface(false);
    surface.adopt(plane(), Source::kCaptured);
    const size_t count = surface.samples().size();
    std::vector<defrec_surface_sample> samples(count);
    for (defrec_surface_sample& sample : samples) {
        sample.observation = DEFREC_INCONSISTENT;
        sample.residual = 3;
    }
    const std::vector<uint8_t> is_confirmed(count, 1), status(count, DEFREC_POINT_EXTRAPOLATED);
    surface.add_depth(samples, is_confirmed, status);
    const auto doubt = [&surface] { return surface.contradicted_depth().doubt_mm(); };
    REQUIRE(doubt().size() == count);
    CHECK(doubt()[0] > 0);
    surface.change(plane());
    CHECK(doubt()[0] > 0);
    surface.adopt(plane(), Source::kCaptured);
    CHECK(doubt()[0] == 0);
}

TEST_CASE("a template that is captured once more keeps its number, and so does one that is not") {
    TrackedSurface surface(false);
    surface.adopt(plane(), Source::kCaptured);
    surface.adopt(plane(), Source::kCapturedAgain);
    check_numbers(surface, 1, 1);
    CHECK(surface.is_tracking());
}

TEST_CASE("the next template takes the number of one that was withdrawn, however often captured") {
    TrackedSurface surface(false);
    surface.adopt(plane(), Source::kCaptured);
    surface.adopt(plane(), Source::kCapturedAgain);
    surface.withdraw();
    CHECK_FALSE(surface.has_template());
    check_numbers(surface, 0, 0);
    surface.adopt(plane(), Source::kCaptured);
    check_numbers(surface, 1, 1);
}
