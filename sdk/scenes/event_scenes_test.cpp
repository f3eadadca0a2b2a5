// The scenes in which something of an operation happens to the tissue or lies on it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "sdk/scenes/film.hpp"

using defrec::cli::Film;
using defrec::cli::FrameState;
using defrec::cli::make_scene;
using defrec::cli::Scene;
using defrec::cli::SceneSetting;
using Eigen::Vector3d;

namespace {

using Settings = std::vector<SceneSetting>;

/// Points that a film shows in each of some frames.
std::vector<std::size_t> visible_in(const std::string& name, const std::vector<int>& frames,
                                    const Settings& settings = {}) {
    Film film(name, 320, 180, 60, 1, 2, settings);
    film.advance();
    std::vector<std::size_t> counts;
    int at = 0;
    for (const int frame : frames) {
        if (frame > at) film.advance(frame - at);
        at = frame;
        std::size_t count = 0;
        for (std::size_t id = 0; id < film.points().size(); ++id) count += film.truth(id).visible;
        counts.push_back(count);
    }
    return counts;
}

}  // namespace

TEST_CASE("a hook holds the tissue where it pulled it") {
    for (const double distance : {0.0, 15.0}) {
        const Scene scene = make_scene("retraction", 320, 180, 60, 1, {{"distance", distance}});
        const auto place = [&](double frame) {
            const FrameState state = scene.at(frame);
            return scene.surface.at(12, 2, frame, state.motion);
        };
        // The beat has a period of 18 frames.
        CHECK((place(24) - place(60)).norm() == doctest::Approx(distance).epsilon(0.01));
        CHECK((place(24) - place(42)).norm() < 1e-9);
        const FrameState held = scene.at(30);
        REQUIRE(held.instruments.size() == 2);
        CHECK((held.instruments[0].tip - place(30)).norm() < 3);
    }
}

TEST_CASE("an instrument that rests hides as much all the time, and all is seen when it left") {
    const auto seen = visible_in("resting", {0, 10, 40, 56});
    CHECK(seen[1] < 0.9 * seen[0]);
    CHECK(std::abs(static_cast<double>(seen[2]) - static_cast<double>(seen[1])) < 12);
    CHECK(seen[3] > 0.95 * seen[0]);
    const auto briefly = visible_in("resting", {0, 10, 30}, {{"rests", 10}});
    CHECK(briefly[1] < 0.9 * briefly[0]);
    CHECK(briefly[2] > 0.95 * briefly[0]);
}

TEST_CASE("a pad of gauze lies on the tissue and moves with it, until it is taken away") {
    const Scene scene = make_scene("gauze", 320, 180, 60, 1, {});
    for (const double frame : {18.0, 25.0, 50.0}) {
        const FrameState state = scene.at(frame);
        for (const double s : {-9.0, 0.0, 9.0}) {
            const Vector3d above = state.sheets[0](s + 4, -3) - state.sheets[1](s, 0);
            CHECK((above - Vector3d(0, 0, 1.3)).norm() < 1e-9);
        }
    }
    const auto seen = visible_in("gauze", {0, 22, 45}, {{"stays", 8}});
    CHECK(seen[1] < 0.9 * seen[0]);
    CHECK(seen[2] > 0.9 * seen[0]);
}

TEST_CASE("a suture's end goes on by its speed, and the thread lies on the tissue behind it") {
    const Scene scene = make_scene("thread", 320, 180, 60, 1, {});
    const auto length = [&](double frame) {
        const FrameState state = scene.at(frame);
        double last = -60;
        for (double s = -60; s <= 60; s += 0.1) {
            const double width = (state.sheets[1](s, 0) - state.sheets[1](s, 0.47)).norm();
            if (width > 0.2) last = s;
        }
        return last;
    };
    CHECK(length(33) - length(23) == doctest::Approx(22).epsilon(0.02));
    const FrameState state = scene.at(40);
    double highest = 0, deepest = 0;
    for (double s = -40; s < 15; s += 0.25) {
        const Vector3d on = state.sheets[1](s, 0);
        const double above = scene.surface.at(on.x(), on.y(), 40, state.motion).z() - on.z();
        highest = std::max(highest, above);
        deepest = std::min(deepest, above);
    }
    CHECK(highest < 3);
    CHECK(deepest > -2);
    CHECK(highest > 0.5);
    CHECK(deepest < -0.1);
}

TEST_CASE("bleeding covers the tissue and is washed away, twice") {
    const auto seen = visible_in("irrigation", {0, 19, 25, 41, 47});
    CHECK(seen[1] < 0.85 * seen[0]);
    CHECK(seen[2] > 0.95 * seen[0]);
    CHECK(seen[3] < 0.85 * seen[0]);
    CHECK(seen[4] > 0.95 * seen[0]);
}
