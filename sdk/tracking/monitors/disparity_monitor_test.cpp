#include "sdk/tracking/monitors/disparity_monitor.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace defrec;

namespace {

constexpr double kFocal = 800, kBaseline = 5;

// A surface 70 to 90 mm from the camera.
TemplateData surface() {
    TemplateData data;
    data.camera = {kFocal, kFocal, 0, 0, kBaseline, 0};
    data.grid.spacing = 15;
    data.width = 640;
    for (int y = -15; y <= 15; ++y)
        for (int x = -20; x <= 20; ++x) {
            defrec_surface_point point{};
            point.position[0] = static_cast<float>(1.5 * x);
            point.position[1] = static_cast<float>(1.5 * y);
            point.position[2] = static_cast<float>(80 + 10 * std::sin(0.2 * x + 0.1 * y));
            data.vertices.push_back(point);
        }
    return data;
}

// Stretched in x and y, turned about the view's axis, moved, and seen by a right view that slipped:
// with disparities that are larger by baseline_drift_px.
std::vector<defrec_surface_sample> seen(const TemplateData& data, double turn,
                                        const double (&shift)[3], double baseline_drift_px,
                                        double stretch = 1) {
    std::vector<defrec_surface_sample> samples;
    for (const defrec_surface_point& vertex : data.vertices) {
        const float* p = vertex.position;
        const double x = stretch * (std::cos(turn) * p[0] - std::sin(turn) * p[1]) + shift[0],
                     y = stretch * (std::sin(turn) * p[0] + std::cos(turn) * p[1]) + shift[1],
                     z = p[2] + shift[2],
                     z_seen = kFocal * kBaseline / (kFocal * kBaseline / z + baseline_drift_px);
        defrec_surface_sample sample{};
        sample.position[0] = static_cast<float>(x * z_seen / z);
        sample.position[1] = static_cast<float>(y * z_seen / z);
        sample.position[2] = static_cast<float>(z_seen);
        sample.observation = DEFREC_OBSERVED;
        samples.push_back(sample);
    }
    return samples;
}

}  // namespace

TEST_CASE("tissue that moves, comes nearer and turns is no slip of the right view") {
    const TemplateData data = surface();
    DisparityMonitor monitor;
    for (const double depth : {0.0, 0.0, -12.0, -5.0, 5.0, 12.0}) {
        CAPTURE(depth);
        monitor.add_frame(data, seen(data, 0.02 * depth, {0.3 * depth, -2, depth}, 0));
        CHECK(monitor.baseline_drift_px() == 0);
    }
}

TEST_CASE("a right view that slips sideways is noticed, how far, and that it is back") {
    const TemplateData data = surface();
    for (const double slip : {-8.0, -2.5, 2.5, 6.0}) {
        CAPTURE(slip);
        const auto slipped = seen(data, 0.02, {1, 0, -1}, slip);
        DisparityMonitor monitor;
        monitor.add_frame(data, seen(data, -0.02, {-1, 0, 1}, 0));
        monitor.add_frame(data, seen(data, 0, {0, 0, 0}, 0));
        monitor.add_frame(data, slipped);
        CHECK(monitor.baseline_drift_px() == doctest::Approx(slip).epsilon(0.1));
        for (int i = 0; i < 100; ++i) monitor.add_frame(data, slipped);
        CHECK(monitor.baseline_drift_px() == doctest::Approx(slip).epsilon(0.1));
        monitor.add_frame(data, seen(data, 0.02, {1, 0.2, -1}, 0));
        CHECK(monitor.baseline_drift_px() == 0);
    }
}

TEST_CASE("a slip after which the surface is observed only some frames later is noticed as well") {
    const TemplateData data = surface();
    const auto rest = seen(data, 0, {0, 0, 0}, 0);
    auto hidden = rest;
    for (defrec_surface_sample& sample : hidden) sample.observation = DEFREC_INCONSISTENT;
    DisparityMonitor monitor;
    monitor.add_frame(data, rest);
    monitor.add_frame(data, rest);
    monitor.add_frame(data, hidden);
    monitor.skip_frame();
    monitor.add_frame(data, seen(data, 0.006, {0.3, 0, -0.3}, 8));
    CHECK(monitor.baseline_drift_px() == doctest::Approx(8).epsilon(0.1));
}

TEST_CASE("tissue that is stretched from one frame to the next is no slip") {
    const TemplateData data = surface();
    for (const double stretch : {0.85, 0.94, 1.06, 1.15}) {
        CAPTURE(stretch);
        DisparityMonitor monitor;
        for (const double now : {1.0, 1.0, stretch, stretch, stretch, 1.0, 1.0, 1.0}) {
            monitor.add_frame(data, seen(data, 0, {0, 0, 0}, 0, now));
            CHECK(monitor.baseline_drift_px() == 0);
        }
    }
}

namespace {

// As seen() sees it at rest, by both views zoomed.
std::vector<defrec_surface_sample> zoomed(const TemplateData& data, double factor,
                                          const double (&shift)[3] = {0, 0, 0}) {
    std::vector<defrec_surface_sample> samples = seen(data, 0, shift, 0);
    for (defrec_surface_sample& sample : samples) sample.position[2] /= static_cast<float>(factor);
    return samples;
}

}  // namespace

TEST_CASE("row 111: a zoom of both views is noticed, how far, and that it is back") {
    const TemplateData data = surface();
    for (const double factor : {1.05, 1.25, 0.8}) {
        CAPTURE(factor);
        DisparityMonitor monitor;
        for (int i = 0; i < 3; ++i) monitor.add_frame(data, zoomed(data, 1));
        const double px = kFocal * kBaseline / 80 * (factor - 1);
        for (int i = 0; i < 10; ++i) {
            monitor.add_frame(data, zoomed(data, factor));
            CHECK(monitor.baseline_drift_px() == doctest::Approx(px).epsilon(0.05));
        }
        monitor.reset();  // another template, seen by the same views
        for (int i = 0; i < 4; ++i) monitor.add_frame(data, zoomed(data, factor));
        CHECK(monitor.baseline_drift_px() == doctest::Approx(px).epsilon(0.05));
        monitor.add_frame(data, zoomed(data, 1));
        CHECK(monitor.baseline_drift_px() == 0);
    }
}

TEST_CASE("row 111: a camera that nears, also where frames are missing, zooms nothing") {
    const TemplateData data = surface();
    for (const int missing : {0, 4, 10}) {
        CAPTURE(missing);
        DisparityMonitor monitor;
        double depth = 0;
        for (int i = 0; i < 12; ++i) {
            depth -= i == 5 ? 1 + missing : 1;
            monitor.add_frame(data, seen(data, 0, {0, 0, depth}, 0));
        }
        CHECK(monitor.baseline_drift_px() == 0);
    }
}

TEST_CASE("a jump of the picture is no slip, and a slip some frames later is noticed") {
    const TemplateData data = surface();
    const auto rest = seen(data, 0, {0, 0, 0}, 0), elsewhere = seen(data, 0, {2, 1, 0}, 3);
    DisparityMonitor monitor;
    monitor.add_frame(data, rest);
    monitor.add_frame(data, rest);
    monitor.add_frame(data, elsewhere);
    CHECK(monitor.baseline_drift_px() == 0);
    for (int i = 0; i < 4; ++i) monitor.add_frame(data, elsewhere);
    CHECK(monitor.baseline_drift_px() == 0);
    monitor.add_frame(data, seen(data, 0, {2, 1, 0}, 6));
    CHECK(monitor.baseline_drift_px() == doctest::Approx(3).epsilon(0.1));
}

TEST_CASE("a frame before which others are missing is compared with none before it") {
    const TemplateData data = surface();
    const auto rest = seen(data, 0, {0, 0, 0}, 0), other = seen(data, 0, {0, 0, 0}, 3);
    DisparityMonitor monitor;
    monitor.add_frame(data, rest);
    monitor.add_frame(data, rest);
    monitor.begin_anew();
    monitor.add_frame(data, other);
    monitor.add_frame(data, other);
    CHECK(monitor.baseline_drift_px() == 0);
}

TEST_CASE("what is no slip, but looked like one, is forgotten within a second") {
    const TemplateData data = surface();
    const auto rest = seen(data, 0, {0, 0, 0}, 0), other = seen(data, 0, {0, 0, 0}, -4);
    DisparityMonitor monitor;
    monitor.add_frame(data, other);
    monitor.add_frame(data, other);
    monitor.add_frame(data, rest);
    CHECK(monitor.baseline_drift_px() > 2);
    for (int i = 0; i < 30; ++i) monitor.add_frame(data, rest);
    CHECK(monitor.baseline_drift_px() == 0);
}

TEST_CASE("what is no slip is forgotten within a second in tissue that is stretched as well") {
    const TemplateData data = surface();
    const auto now = seen(data, 0, {0, 0, 0}, 0, 1.15), other = seen(data, 0, {0, 0, 0}, -4, 1.15);
    DisparityMonitor monitor;
    monitor.add_frame(data, other);
    monitor.add_frame(data, other);
    monitor.add_frame(data, now);
    CHECK(monitor.baseline_drift_px() > 2);
    for (int i = 0; i < 29; ++i) monitor.add_frame(data, now);
    CHECK(monitor.baseline_drift_px() == 0);
}

TEST_CASE("a slip stays noticed while the tissue is stretched") {
    const TemplateData data = surface();
    const auto rest = seen(data, 0, {0, 0, 0}, 0);
    DisparityMonitor monitor;
    monitor.add_frame(data, rest);
    monitor.add_frame(data, rest);
    for (int i = 0; i < 100; ++i)
        monitor.add_frame(data, seen(data, 0, {0, 0, 0}, 3, std::min(1 + 0.01 * i, 1.3)));
    CHECK(monitor.baseline_drift_px() == doctest::Approx(3).epsilon(0.1));
}

TEST_CASE("vertices that are not observed say nothing of a slip") {
    const TemplateData data = surface();
    const auto rest = seen(data, 0, {0, 0, 0}, 0);
    auto slipped = seen(data, 0, {0, 0, 0}, 4);
    for (size_t i = 40; i < slipped.size(); ++i) slipped[i].observation = DEFREC_NO_DEPTH;
    DisparityMonitor monitor;
    monitor.add_frame(data, rest);
    monitor.add_frame(data, rest);
    monitor.add_frame(data, slipped);
    CHECK(monitor.baseline_drift_px() == 0);
}
