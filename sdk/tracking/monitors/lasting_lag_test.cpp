// A lag that lasts, from rows and disparities of tissue that moves, without images.
#include "sdk/tracking/monitors/lasting_lag.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>

using namespace defrec;

namespace {

// How tissue swings, and how the right view is late.
struct Swing {
    double lag = 0, angle = 0;      // frames; of the motion to the rows, rad
    double speed = 4, period = 60;  // px per frame at its fastest; frames
    double swell = 0;               // px of disparity by which it comes nearer while it swings
    double strain = 0;              // by which it stretches along the rows meanwhile
    double depth_with_speed = 0;    // px of disparity, in step with the speed, while scale follows
};

class Tissue {
  public:
    explicit Tissue(const Swing& swing) : swing_(swing) {}

    std::vector<RowMatch> frame(int time, uint32_t seed) const {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> share(0, 1);
        std::normal_distribution<double> noise(0, 0.2);
        std::vector<RowMatch> matches;
        for (int i = 0; i < 150; ++i) {
            const double x = (share(random) - 0.5) * 960, y = (share(random) - 0.5) * 540;
            const double along = place(time, x).x - place(time - 1, x).x,
                         down = place(time, x).y - place(time - 1, x).y +
                                y * (scale(time) - scale(time - 1));
            const bool is_wrong = share(random) < 0.1;
            matches.push_back(
                {.x = x,
                 .y = y,
                 .step = -swing_.lag * down + noise(random) + (is_wrong ? 8 * noise(random) : 0),
                 .speed = down,
                 .turn = x * y / 1000,
                 .along = along + x * (scale(time) - scale(time - 1)),
                 .growth = disparity(time, x) - disparity(time - 1, x) + noise(random) +
                           (is_wrong ? 20 * noise(random) : 0)});
        }
        return matches;
    }

  private:
    struct Place {
        double x, y;
    };
    double phase(double time) const { return 2 * std::numbers::pi * time / swing_.period; }
    double half() const { return swing_.speed * swing_.period / (2 * std::numbers::pi); }
    Place place(double time, double x) const {
        const double moved = half() * std::sin(phase(time));
        return {moved * std::cos(swing_.angle) + swing_.strain * x * std::sin(phase(time) * 0.7),
                moved * std::sin(swing_.angle)};
    }
    double scale(double time) const {
        return (swing_.swell * std::sin(phase(time)) +
                swing_.depth_with_speed * std::cos(phase(time))) /
               57;
    }
    double disparity(double time, double x) const {
        return 57 * scale(time) + swing_.lag * (place(time, x).x - place(time - 1, x).x);
    }
    Swing swing_;
};

// Frames until a lag shows; 1000: none does.
int frames_to_lag(LastingLag& lag, const Swing& swing, int frames) {
    const Tissue tissue(swing);
    RowValues sigma(20, 0.05, 0.05, 0.05, 1.5);
    const RowKnowledge known{sigma.cwiseAbs2().cwiseInverse().asDiagonal(), RowValues::Zero()};
    int shown = 1000;
    for (int i = 0; i < frames; ++i) {
        lag.add_frame(tissue.frame(i, static_cast<uint32_t>(i)), known,
                      swing.lag * RowValues::Unit(4), false);
        if (lag.lag() != 0) shown = std::min(shown, i);
    }
    return shown;
}

}  // namespace

TEST_CASE("row 107: depth that swings with the speed along the rows is a lag") {
    for (const double late : {1.0, -1.0, 0.5, 2.0})
        for (const double speed : {1.2, 4.0, 6.0}) {
            CAPTURE(late);
            CAPTURE(speed);
            LastingLag lag;
            CHECK(frames_to_lag(lag, {.lag = late, .speed = speed, .period = 240 / speed}, 60) <=
                  40);
            CHECK(lag.lag() == doctest::Approx(late).epsilon(0.15));
            CHECK(lag.unseen() == 0);
        }
}

TEST_CASE("row 107: motion at 2 to 20 degrees to the rows shows a lag in rows and depth alike") {
    for (const double degrees : {2.0, 5.0, 10.0, 20.0}) {
        CAPTURE(degrees);
        LastingLag lag;
        CHECK(frames_to_lag(lag, {.lag = 1, .angle = degrees * std::numbers::pi / 180}, 40) <= 20);
        CHECK(lag.lag() == doctest::Approx(1).epsilon(0.1));
    }
}

TEST_CASE("row 107: tissue that swells, stretches or comes nearer as it moves is no lag") {
    const Swing swings[] = {{},
                            {.swell = 6},
                            {.strain = 0.15},
                            {.depth_with_speed = 5},
                            {.angle = 0.5, .swell = 4, .strain = 0.1},
                            {.speed = 0}};
    for (const Swing& swing : swings) {
        CAPTURE(swing.swell);
        CAPTURE(swing.strain);
        CAPTURE(swing.depth_with_speed);
        LastingLag lag;
        CHECK(frames_to_lag(lag, swing, 150) == 1000);
    }
}

TEST_CASE("row 107: a lag that nothing shows is not excluded") {
    LastingLag lag;
    CHECK(lag.unseen() > 0);
    frames_to_lag(lag, {.speed = 0}, 30);
    CHECK(lag.unseen() > 0);
    frames_to_lag(lag, {.angle = 1}, 5);
    CHECK(lag.unseen() == 0);
}

TEST_CASE("row 107: a lag is plausible until it is told, and less so as rows show none") {
    constexpr double kUnseen = decisions::LastingLag::kUnseen;
    LastingLag along, at_an_angle, late;
    CHECK(along.unseen() == kUnseen);
    frames_to_lag(along, {}, 8);
    CHECK(along.unseen() == doctest::Approx(kUnseen).epsilon(0.1));
    frames_to_lag(at_an_angle, {.angle = 0.15}, 8);
    CHECK(at_an_angle.unseen() < 0.7 * kUnseen);
    CHECK(at_an_angle.unseen() > 0);
    frames_to_lag(late, {.lag = 1}, 8);
    CHECK(late.lag() == 0);
    CHECK(2 * late.unseen() >= 1);
}

TEST_CASE("row 107: a lag stays while nothing says otherwise") {
    LastingLag lag;
    frames_to_lag(lag, {.lag = 1}, 40);
    lag.break_off();
    frames_to_lag(lag, {.lag = 1, .speed = 0.01}, 20);
    CHECK(lag.lag() == doctest::Approx(1).epsilon(0.1));
}

TEST_CASE("row 107: a single late frame is none of a lag that lasts") {
    const RowValues sigma(0.05, 0.001, 0.001, 0.001, 1.5);
    const RowKnowledge known{sigma.cwiseAbs2().cwiseInverse().asDiagonal(), RowValues::Zero()};
    const Tissue late({.lag = 1, .angle = 1}), in_time({.angle = 1});
    LastingLag lag;
    for (int i = 0; i < 20; ++i)
        lag.add_frame(in_time.frame(i, static_cast<uint32_t>(i)), known, RowValues::Zero(), false);
    lag.add_frame(late.frame(20, 20), known, RowValues::Unit(4), true);
    for (int i = 21; i < 40; ++i) {
        lag.add_frame(in_time.frame(i, static_cast<uint32_t>(i)), known, RowValues::Zero(), false);
        CHECK(lag.lag() == 0);
    }
}
