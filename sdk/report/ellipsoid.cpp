#include "sdk/report/ellipsoid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace defrec::cli {
namespace {

std::int16_t steps(double mm) {
    constexpr double kMax = std::numeric_limits<std::int16_t>::max();
    return static_cast<std::int16_t>(std::lround(std::clamp(mm / kShapeStepMm, -kMax, kMax)));
}

}  // namespace

std::array<std::int16_t, 6> ellipsoid_shape(const std::array<float, 6>& covariance) {
    const auto [xx, xy, xz, yy, yz, zz] = covariance;
    const auto root = [](double square) { return std::sqrt(std::max(0.0, square)); };
    const auto over = [](double value, double by) { return by > 0 ? value / by : 0; };
    const double a = root(double{xx}), b = over(double{xy}, a), c = over(double{xz}, a);
    const double d = root(double{yy} - b * b), e = over(double{yz} - b * c, d);
    const double f = root(double{zz} - c * c - e * e);
    return {steps(a), steps(b), steps(d), steps(c), steps(e), steps(f)};
}

}  // namespace defrec::cli
