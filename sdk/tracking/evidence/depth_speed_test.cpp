// Disparities that are not measured go on as they went.
#include "sdk/tracking/evidence/depth_speed.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

using namespace defrec;

namespace {

constexpr defrec_camera kCamera{400, 400, 160, 120, 5, 0};
using Samples = std::vector<defrec_surface_sample>;

// Observed vertices at these disparities, px.
Samples at(const std::vector<double>& disparities) {
    Samples samples;
    for (const double disparity : disparities) {
        defrec_surface_sample sample{};
        sample.position[2] = static_cast<float>(kCamera.fx * kCamera.baseline_mm / disparity);
        sample.observation = DEFREC_OBSERVED;
        samples.push_back(sample);
    }
    return samples;
}

// The first of two vertices comes nearer by so much a frame, the other stays.
struct Motion {
    explicit Motion(double px) : step(px) { speed.begin(2); }
    void go_on(int frames, bool is_measured) {
        for (int i = 0; i < frames; ++i) {
            const Samples before = at({first, 25});
            first += step;
            speed.add_frame(kCamera, before, at({first, 25}), is_measured);
        }
    }
    double px(size_t vertex) const { return std::sqrt(speed.unmeasured_px2(vertex)); }
    DepthSpeed speed;
    double step, first = 25;
};

}  // namespace

TEST_CASE("errors of depth grow with the speed and the frames without it") {
    Motion motion(0.2), slow(0.1), still(0);
    for (Motion* each : {&motion, &slow, &still}) each->go_on(60, true);
    CHECK(still.px(0) == doctest::Approx(0).epsilon(1e-3));
    const double once = motion.px(0);
    CHECK(once > 0.1);
    CHECK(motion.px(1) < once);
    CHECK(motion.px(1) > 0);
    CHECK(slow.px(0) == doctest::Approx(once / 2).epsilon(0.02));
    motion.go_on(4, false);
    CHECK(motion.px(0) == doctest::Approx(5 * once).epsilon(0.02));
    motion.go_on(200, false);
    const double most = motion.px(0);
    motion.go_on(1, false);
    CHECK(motion.px(0) == doctest::Approx(most));
    motion.go_on(1, true);
    CHECK(motion.px(0) == doctest::Approx(once).epsilon(0.02));
}

TEST_CASE("tissue that turned back is still about to move, and less so with time") {
    Motion motion(0.2);
    motion.go_on(60, true);
    const double moving = motion.px(1);
    motion.step = 0;
    motion.go_on(10, true);
    CHECK(motion.px(1) > 0.7 * moving);
    motion.go_on(600, true);
    CHECK(motion.px(1) < 0.01 * moving);
}

TEST_CASE("what follows from no frame before says nothing of the speed") {
    Motion motion(0.2);
    motion.go_on(1, true);  // the template's own frame is before it
    CHECK(motion.px(0) == 0);
    motion.step = 0;
    motion.go_on(60, true);
    motion.speed.interrupt();
    motion.step = 30;
    motion.go_on(1, true);
    CHECK(motion.px(0) == 0);
    motion.go_on(1, false);
    motion.go_on(1, true);  // the way of two frames
    CHECK(motion.px(0) == 0);
}
