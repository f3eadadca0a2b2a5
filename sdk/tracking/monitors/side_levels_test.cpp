#include "sdk/tracking/monitors/side_levels.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace defrec;

namespace {

constexpr int kColumns = 30, kRows = 21;
constexpr double kReach = 8;

// A region at the right of x = 15 that moves by inside(x, y), beside what moves by outside(x, y).
struct Sides {
    SurfaceGrid grid;
    std::vector<uint8_t> is_inside;
    std::vector<float> moved;

    template <class Inside, class Outside>
    Sides(const Inside& inside, const Outside& outside) {
        grid.columns = kColumns;
        grid.rows = kRows;
        for (int y = 0; y < kRows; ++y)
            for (int x = 0; x < kColumns; ++x) {
                is_inside.push_back(x >= 15 ? 1 : 0);
                moved.push_back(static_cast<float>(x >= 15 ? inside(x, y) : outside(x, y)));
            }
    }
    std::optional<double> step() const {
        return SideLevels(grid, is_inside, moved).step_at({14.5, 10}, 0, kReach);
    }
};

double no_motion(int, int) { return 0; }

}  // namespace

TEST_CASE("a step counts by its height, and a slope for nothing") {
    const auto rises = [](int x, int y) { return -0.5 * (x - 14.5) + 0.2 * y; };
    const auto stands_off = [](int x, int y) { return -4 - 0.1 * (x - 14.5) + 0.1 * (y - 10); };
    CHECK(*Sides(stands_off, no_motion).step() == doctest::Approx(-4).epsilon(0.01));
    CHECK(std::abs(*Sides(rises, rises).step()) < 0.01);
    const auto bends = [](int x, int) { return x < 15 ? 0 : -0.02 * (x - 14.5) * (x - 14.5); };
    CHECK(std::abs(*Sides(bends, bends).step()) < 0.5);
}

TEST_CASE("the cells beside the outline do not count") {
    const auto mixed = [](int x, int) { return x < 17 ? 9.0 : -4.0; };
    CHECK(*Sides(mixed, no_motion).step() == doctest::Approx(-4).epsilon(0.01));
}

TEST_CASE("a side of which little is seen has no level") {
    const auto unseen = [](int x, int) {
        return x < 22 ? std::numeric_limits<double>::quiet_NaN() : -4.0;
    };
    CHECK(!Sides(unseen, no_motion).step());
    CHECK(!Sides(no_motion, [](int, int) {
               return std::numeric_limits<double>::quiet_NaN();
           }).step());
}
