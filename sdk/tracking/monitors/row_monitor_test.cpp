// A right view that is late or lies askew, from rows alone.
#include "sdk/tracking/monitors/row_monitor.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <random>

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 960, kHeight = 540;
constexpr double kFocal = 1000;  // px

// How the right view lies, and how the tissue moves: rows by speed px per frame where the wave
// is 1.
struct Setting {
    double offset = 0, roll = 0, ratio = 0, lag = 0, speed = 6;
    double vergence = 0;     // rad
    double outliers = 0.15;  // share of the matches that are wrong
    double left_noise = 0;   // px, of rows in the left view
};

std::vector<RowMatch> matches_of(const Setting& setting, uint32_t seed, size_t count = 150) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    std::normal_distribution<double> noise(0, 0.2);
    std::vector<RowMatch> matches;
    for (size_t i = 0; i < count; ++i) {
        RowMatch match{};
        match.x = (share(random) - 0.5) * kWidth;
        match.y = (share(random) - 0.5) * kHeight;
        match.speed = setting.speed * std::sin(0.01 * match.x + 0.013 * match.y);
        match.turn = match.x * match.y / kFocal;
        match.step = setting.offset + setting.roll * match.x + setting.ratio * match.y -
                     setting.lag * match.speed + noise(random) + setting.vergence * match.turn;
        if (share(random) < setting.outliers) match.step += 30 * (share(random) - 0.5);
        const double wrong = setting.left_noise > 0 ? setting.left_noise * noise(random) / 0.2 : 0;
        match.step -= wrong;
        match.speed += wrong;
        matches.push_back(match);
    }
    return matches;
}

}  // namespace

TEST_CASE("a right rig is neither late nor out of calibration, whatever moves") {
    RowMonitor monitor(kWidth, kHeight);
    for (uint32_t frame = 0; frame < 40; ++frame) {
        const RigEstimate estimate = monitor.update(matches_of({}, frame));
        CHECK_FALSE(monitor.is_late());
        CHECK_FALSE(monitor.is_out_of_calibration());
        CHECK(estimate.lag_frames == 0);
        CHECK(std::abs(estimate.vertical_offset_px) < 0.1);
    }
}

namespace {

// The shared noise after matches whose noise by itself and in blocks of 16 px has these standard
// deviations, px.
double shared_noise_of(double own, double of_blocks) {
    RowMonitor monitor(kWidth, kHeight);
    RigEstimate estimate;
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0, 1);
    for (uint32_t frame = 0; frame < 40; ++frame) {
        std::vector<RowMatch> matches = matches_of({.outliers = 0}, frame, 300);
        std::map<std::pair<int, int>, double> blocks;
        for (RowMatch& match : matches) {
            const std::pair block(int(std::floor(match.x / 16)), int(std::floor(match.y / 16)));
            const auto [found, is_new] = blocks.try_emplace(block, 0);
            if (is_new) found->second = of_blocks * noise(random);
            match.step += found->second + own * noise(random);
        }
        estimate = monitor.update(matches);
    }
    return double{estimate.shared_noise_px2};
}

}  // namespace

TEST_CASE("noise that matches side by side share is measured, and no other") {
    const double square = 0.4 * 0.4;
    CHECK(shared_noise_of(0, 0) < 0.03 * square);
    CHECK(shared_noise_of(0.4, 0) < 0.03 * square);
    // A block is smaller than the cell that it is measured by, 30 px.
    const double shared = shared_noise_of(0, 0.4);
    CHECK(shared > 0.1 * square);
    CHECK(shared < square);
    CHECK(shared_noise_of(0, 0.8) == doctest::Approx(4 * shared).epsilon(0.2));
}

TEST_CASE("a vergence is surer the less noisy the rows are") {
    const auto sigma_of = [](double left_noise) {
        RowMonitor monitor(kWidth, kHeight);
        return double{monitor.update(matches_of({.outliers = 0, .left_noise = left_noise}, 1))
                          .vergence_sigma};
    };
    CHECK(sigma_of(0.6) > 1.3 * sigma_of(0));
}

TEST_CASE("a lag shows in the frames that have it, whole or fractional, late or early") {
    for (const double lag : {1.0, 0.4, -0.7}) {
        CAPTURE(lag);
        RowMonitor monitor(kWidth, kHeight);
        for (uint32_t frame = 0; frame < 30; ++frame) {
            Setting setting;
            const bool is_late = frame >= 10 && frame < 20;
            if (is_late) setting.lag = lag;
            const RigEstimate estimate = monitor.update(matches_of(setting, frame));
            CHECK(monitor.is_late() == is_late);
            CHECK(estimate.lag_frames == doctest::Approx(setting.lag).epsilon(0.05));
            CHECK(std::abs(estimate.vertical_offset_px) < 0.1);
        }
    }
}

namespace {

// All rows move alike.
std::vector<RowMatch> swinging(double lag, uint32_t frame) {
    std::vector<RowMatch> matches = matches_of({.speed = 0}, frame);
    for (RowMatch& match : matches) {
        match.speed = 2 * std::sin(0.2 * frame + 1);
        match.step -= lag * match.speed;
        match.along = 0;
    }
    return matches;
}

}  // namespace

TEST_CASE("row 107: a lag from the first frame on is told where all rows move alike, and ends") {
    RowMonitor monitor(kWidth, kHeight);
    size_t late = 0;
    for (uint32_t frame = 0; frame < 60; ++frame) {
        monitor.update(swinging(1, frame));
        late += monitor.is_late();
        if (frame < 15) continue;
        CAPTURE(frame);
        CHECK(monitor.is_late());
        CHECK(monitor.update({}).lag_frames == doctest::Approx(1).epsilon(0.1));
    }
    CHECK(late >= 50);
    for (uint32_t frame = 60; frame < 90; ++frame) {
        monitor.update(swinging(0, frame));
        CHECK((!monitor.is_late() || frame < 70));
    }
}

TEST_CASE("row 107: a lag that lasts counts in frames that are not measured, no other does") {
    RowMonitor lasting(kWidth, kHeight);
    for (uint32_t frame = 0; frame < 20; ++frame) lasting.update(swinging(1, frame));
    for (int skipped = 0; skipped < 3; ++skipped) {
        CHECK(lasting.skip().lag_frames == doctest::Approx(1).epsilon(0.1));
        CHECK(lasting.is_late());
    }
    RowMonitor single(kWidth, kHeight);
    for (uint32_t frame = 0; frame < 20; ++frame)
        single.update(matches_of({.lag = frame == 19 ? 1.0 : 0.0}, frame));
    CHECK(single.is_late());
    CHECK(single.skip().lag_frames == 0);
    CHECK_FALSE(single.is_late());
}

TEST_CASE("rows that are wrong in the left view look like a lag, and are none") {
    RowMonitor monitor(kWidth, kHeight);
    for (uint32_t frame = 0; frame < 200; ++frame) {
        CAPTURE(frame);
        const RigEstimate estimate =
            monitor.update(matches_of({.speed = 0.6, .left_noise = 0.5}, frame));
        CHECK_FALSE(monitor.is_late());
        CHECK(estimate.lag_frames == 0);
    }
}

TEST_CASE("a lag of a single frame shows, also where rows are wrong in the left view") {
    for (const double left_noise : {0.0, 0.3}) {
        CAPTURE(left_noise);
        RowMonitor monitor(kWidth, kHeight);
        for (uint32_t frame = 0; frame < 60; ++frame) {
            CAPTURE(frame);
            Setting setting{.speed = 2, .left_noise = left_noise};
            if (frame % 20 == 10) setting.lag = 1;
            monitor.update(matches_of(setting, frame));
            CHECK(monitor.is_late() == (setting.lag > 0));
        }
    }
}

TEST_CASE("nothing can be said of a lag while rows rest") {
    RowMonitor monitor(kWidth, kHeight);
    Setting setting;
    setting.lag = 1;
    setting.speed = 0.02;
    for (uint32_t frame = 0; frame < 10; ++frame)
        CHECK(monitor.update(matches_of(setting, frame)).lag_frames == 0);
}

TEST_CASE("offset, roll and ratio of focal lengths are measured together, within ten frames") {
    RowMonitor monitor(kWidth, kHeight);
    const Setting setting{.offset = 1.2, .roll = 0.0026, .ratio = 0.001};
    RigEstimate estimate;
    for (uint32_t frame = 0; frame < 10; ++frame)
        estimate = monitor.update(matches_of(setting, frame));
    CHECK(monitor.is_out_of_calibration());
    CHECK_FALSE(monitor.is_late());
    CHECK(estimate.vertical_offset_px == doctest::Approx(1.2).epsilon(0.03));
    CHECK(estimate.roll_deg == doctest::Approx(0.149).epsilon(0.05));
    CHECK(estimate.focal_ratio == doctest::Approx(1.001).epsilon(1e-4));
    CHECK(estimate.matches > 1000);
}

TEST_CASE("row 108: a right view that is turned is measured within ten frames, and told") {
    for (const double vergence : {-0.0175, 0.00436, 0.035, 0.0005}) {
        CAPTURE(vergence);
        RowMonitor monitor(kWidth, kHeight);
        const Setting setting{.vergence = vergence};
        RigEstimate estimate;
        for (uint32_t frame = 0; frame < 10; ++frame)
            estimate = monitor.update(matches_of(setting, frame));
        const double error = std::abs(estimate.vergence - vergence);
        CHECK(error < 0.0005);
        CHECK(error < 3 * double{estimate.vergence_sigma});
        CHECK(monitor.is_out_of_calibration() == (std::abs(vergence) > 0.001));
        CHECK(monitor.wants_correction() == (std::abs(vergence) > 0.001));
        CHECK(std::abs(estimate.vertical_offset_px) < 0.1);
        CHECK_FALSE(monitor.is_late());
    }
}

TEST_CASE("a drift is followed within a second or two, and a lag is told from it") {
    RowMonitor monitor(kWidth, kHeight);
    RigEstimate estimate;
    for (uint32_t frame = 0; frame < 150; ++frame) {
        Setting setting;
        setting.offset = 0.01 * frame;
        setting.lag = frame >= 140 ? 1 : 0;
        estimate = monitor.update(matches_of(setting, frame));
        CHECK(monitor.is_late() == (setting.lag > 0));
    }
    CHECK(estimate.vertical_offset_px == doctest::Approx(1.2).epsilon(0.2));
}

TEST_CASE("few matches, or none, say nothing") {
    RowMonitor monitor(kWidth, kHeight);
    Setting setting;
    setting.offset = 3;
    CHECK(monitor.update(matches_of(setting, 1, 10)).matches == 0);
    CHECK(monitor.update({}).matches == 0);
    CHECK_FALSE(monitor.is_out_of_calibration());
}
