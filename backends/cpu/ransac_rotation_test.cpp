// The rotation nearest to a matrix, as ransac on the CPU finds it.
#include <doctest/doctest.h>

#include <Eigen/Dense>

#include "backends/cpu/ransac_kernels.hpp"
#include "backends/shared/test_ransac.hpp"

using namespace defrec;
using namespace defrec::test;

TEST_CASE("the nearest rotation is Kabsch's for every kind of matrix") {
    std::mt19937 random(2);
    for (int trial = 0; trial < 300; ++trial) {
        Eigen::Matrix3d m;
        for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = signed_unit(random);
        if (trial % 3 == 1) m.col(2).setZero();  // a plane of points
        if (trial % 3 == 2) m *= 1e6;
        double given[9];
        for (int i = 0; i < 9; ++i) given[i] = m(i / 3, i % 3);
        float got[9];
        cpu::nearest_rotation(given, got);
        const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
        const Eigen::Matrix3d s = svd.matrixU().transpose() * m * svd.matrixV();
        const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
        Eigen::Matrix3d rotation;
        for (int i = 0; i < 9; ++i) rotation(i / 3, i % 3) = double(got[i]);
        CHECK(rotation.determinant() == doctest::Approx(1).epsilon(1e-5));
        // As good as the best, even where the best is not unique.
        CHECK(rotation.cwiseProduct(m).sum() ==
              doctest::Approx(s(0, 0) + s(1, 1) + sign * s(2, 2)).epsilon(1e-5));
    }
    const double zero[9] = {};
    float identity[9];
    cpu::nearest_rotation(zero, identity);
    for (int i = 0; i < 9; ++i) CHECK(identity[i] == (i % 4 == 0 ? 1.0f : 0.0f));
}
