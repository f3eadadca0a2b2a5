// Ellipsoids have the covariance that they were made from.
#include "sdk/report/ellipsoid.hpp"

#include <doctest/doctest.h>

#include <cstddef>

using namespace defrec::cli;

TEST_CASE("the shape times its transpose is the covariance") {
    const std::array<float, 6> covariance{0.25F, 0.03F, -0.1F, 0.04F, 0.02F, 1.44F};
    const std::array<std::int16_t, 6> shape = ellipsoid_shape(covariance);
    const double l[3][3] = {
        {shape[0] * kShapeStepMm, 0, 0},
        {shape[1] * kShapeStepMm, shape[2] * kShapeStepMm, 0},
        {shape[3] * kShapeStepMm, shape[4] * kShapeStepMm, shape[5] * kShapeStepMm}};
    for (std::size_t row = 0, k = 0; row < 3; ++row)
        for (std::size_t column = row; column < 3; ++column, ++k) {
            double product = 0;
            for (std::size_t i = 0; i < 3; ++i) product += l[row][i] * l[column][i];
            CHECK(product == doctest::Approx(double{covariance[k]}).epsilon(0.01));
        }
}

TEST_CASE("a direction without variance is flat, and a huge one is cut off") {
    CHECK(ellipsoid_shape({0, 0, 0, 1, 0, 0}) == std::array<std::int16_t, 6>{0, 0, 1000, 0, 0, 0});
    CHECK(ellipsoid_shape({1e9F, 0, 0, 0, 0, 0})[0] == 32767);
}
