// The formulas of the surface: what they promise about areas and lengths, and that no material is
// folded over.
#include "sdk/scenes/surface.hpp"

#include <doctest/doctest.h>

#include <Eigen/LU>

using defrec::cli::Motion;
using defrec::cli::Side;
using defrec::cli::Surface;

namespace {

const Surface kFlat(80, 0, 1);

Eigen::Vector2d plane(const Motion& motion, double s, double t) {
    return kFlat.at(s, t, 0, motion).head<2>();
}

/// Area in the picture's plane of a small piece of material, relative to rest.
double area(const Motion& motion, double s, double t) {
    constexpr double kStep = 1e-4;
    Eigen::Matrix2d jacobian;
    jacobian << plane(motion, s + kStep, t) - plane(motion, s - kStep, t),
        plane(motion, s, t + kStep) - plane(motion, s, t - kStep);
    return (jacobian / (2 * kStep)).determinant();
}

double smallest_area(const Motion& motion) {
    double smallest = 1e9;
    for (double s = -60; s <= 60; s += 0.5) {
        for (double t = -50; t <= 50; t += 0.5) {
            smallest = std::min(smallest, area(motion, s, t));
        }
    }
    return smallest;
}

}  // namespace

TEST_CASE("a grasped place goes as far as it is pulled, and folds nothing over") {
    Motion motion;
    motion.pull = {.by = {9, 0, -12}, .centre = {3, -2}};
    CHECK((kFlat.at(3, -2, 0, motion) - kFlat.at(3, -2, 0, {}) - motion.pull.by).norm() < 1e-9);
    CHECK(smallest_area(motion) > 0.1);
}

TEST_CASE("the sides of a cut part by its gap and fold nothing over, the floor joins them") {
    Motion motion;
    motion.incision = {.gap = 9, .half_length = 18};
    const auto side = [&](double s, Side which) { return kFlat.at(s, 0, 0, motion, which); };
    CHECK((side(0, Side::below) - side(0, Side::above)).norm() == doctest::Approx(9));
    CHECK(side(18, Side::below) == side(18, Side::above));
    CHECK(kFlat.at(0, -0.5, 0, motion).y() == doctest::Approx(-4.85).epsilon(0.01));
    CHECK(kFlat.at(0, 0.5, 0, motion).y() == doctest::Approx(4.85).epsilon(0.01));
    CHECK(smallest_area(motion) > 0.6);
    for (const double s : {-17.0, 0.0, 6.3}) {
        CHECK(kFlat.floor_at(s, -1, 0, motion) == side(s, Side::above));
        CHECK(kFlat.floor_at(s, 1, 0, motion) == side(s, Side::below));
    }
    CHECK(kFlat.floor_at(0, 0, 0, motion).z() - side(0, Side::above).z() > 6);
    SUBCASE("at the ends of the parameters' ranges") {
        motion.incision = {.gap = 12, .half_length = 5};
        CHECK(smallest_area(motion) > 0.5);
    }
}

TEST_CASE("lobes lie a step apart, one slides along the other, and a wall joins them") {
    Motion motion;
    motion.lobes = {.step = 8, .slide = {5, 0.5}};
    const auto side = [&](double s, Side which) { return kFlat.at(s, 0, 0, motion, which); };
    const Eigen::Vector3d between = side(3, Side::below) - side(3, Side::above);
    CHECK((between - Eigen::Vector3d(5, 1.5, 8)).norm() < 1e-9);
    CHECK(kFlat.at(3, -1, 0, motion).z() < kFlat.at(3, 1, 0, motion).z() - 7);
    CHECK(kFlat.floor_at(3, -1, 0, motion) == side(3, Side::above));
    CHECK(kFlat.floor_at(3, 1, 0, motion) == side(3, Side::below));
}

TEST_CASE("a pinch leaves 0.35 of the area, takes 5 mm off 18 mm, and folds nothing over") {
    Motion motion;
    motion.pinch = {.depth = 11, .gather = 1 - std::sqrt(0.35), .centre = {3, -2}, .drag = {0, 0}};
    CHECK(area(motion, 3, -2) == doctest::Approx(0.35).epsilon(1e-3));
    CHECK(smallest_area(motion) == doctest::Approx(0.35).epsilon(1e-3));
    CHECK((plane(motion, 12, -2) - plane(motion, -6, -2)).norm() ==
          doctest::Approx(13.0).epsilon(0.01));
    CHECK(kFlat.at(3, -2, 0, motion).z() - kFlat.at(3, -2, 0, {}).z() == doctest::Approx(11));
    SUBCASE("at the ends of the parameters' ranges") {
        motion.pinch.gather = 0.5;
        motion.pinch.drag = {4, 0};
        CHECK(smallest_area(motion) > 0.1);
    }
}
