// See starts.hpp. Points of a ball by Halton's sequence (On the efficiency of certain quasi-random
// sequences of points, Numerische Mathematik 2, 1960), so that any number of them is spread evenly.
#include "sdk/registration/starts.hpp"

#include <cmath>
#include <numbers>

namespace defrec {
namespace {

// The digits of a number in a base, mirrored at the point: 0..1.
double mirrored(uint32_t number, uint32_t base) {
    double value = 0, digit = 1.0 / base;
    for (; number > 0; number /= base, digit /= base) value += digit * (number % base);
    return value;
}

// Volume-preserving from three numbers of 0..1 to the unit ball.
Eigen::Vector3d in_ball(double radius, double height, double angle) {
    constexpr double kTurn = 2 * std::numbers::pi;
    const double z = 2 * height - 1, side = std::sqrt(1 - z * z);
    return std::cbrt(radius) *
           Eigen::Vector3d(side * std::cos(kTurn * angle), side * std::sin(kTurn * angle), z);
}

}  // namespace

std::vector<Pose> spread_starts(const Pose& start, const Eigen::Vector3d& centre, double turn,
                                double shift_mm, uint32_t count) {
    std::vector<Pose> made{start};
    for (uint32_t i = 1; i < count; ++i) {
        Twist twist;
        twist << turn * in_ball(mirrored(i, 2), mirrored(i, 3), mirrored(i, 5)),
            shift_mm * in_ball(mirrored(i, 7), mirrored(i, 11), mirrored(i, 13));
        made.push_back(moved(start, twist, centre));
    }
    return made;
}

}  // namespace defrec
