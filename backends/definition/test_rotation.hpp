// What every backend's rotation nearest to a matrix has to be.
#pragma once
#include <doctest/doctest.h>

#include <Eigen/Dense>

#include "backends/definition/test_ransac.hpp"

namespace defrec::test {

// nearest: of an Eigen::Matrix3d, as one.
template <class Nearest>
void check_nearest_rotation(const Nearest& nearest) {
    constexpr unsigned kBothSides = Eigen::ComputeFullU | Eigen::ComputeFullV;
    std::mt19937 random(2);
    for (int trial = 0; trial < 4000; ++trial) {
        Eigen::Matrix3d m;
        for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = signed_unit(random);
        if (trial % 8 == 1) m.col(2).setZero();        // a plane of points
        if (trial % 8 == 2) m.rightCols<2>() *= 1e-4;  // a line, nearly
        if (trial % 8 == 3) m = Eigen::HouseholderQR<Eigen::Matrix3d>(m).householderQ();
        if (trial % 8 == 4) m = m * m.transpose() * 1e6 - Eigen::Matrix3d::Identity();
        if (trial % 8 == 5) m.col(1) = m.col(0) + 1e-3 * m.col(1);
        if (trial % 8 == 6) {  // a mirror image whose best rotation is hardly better than others
            const Eigen::JacobiSVD<Eigen::Matrix3d> any(m, kBothSides);
            const double second = 0.1 + 0.9 * std::abs(signed_unit(random)),
                         gap = std::pow(10, -2 + signed_unit(random));
            const Eigen::Matrix3d u = any.matrixU() * any.matrixU().determinant(),
                                  v = any.matrixV() * any.matrixV().determinant();
            m = u * Eigen::Vector3d(1, second, gap - second).asDiagonal() * v.transpose();
        }
        if (trial % 8 == 7) m *= 1e6;
        const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, kBothSides);
        const Eigen::Vector3d values = svd.singularValues();
        const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
        const Eigen::Matrix3d rotation = nearest(m);
        CAPTURE(trial);
        CHECK(rotation.determinant() == doctest::Approx(1).epsilon(1e-5));
        // As good as the best, even where the best is not unique.
        CHECK(rotation.cwiseProduct(m).sum() ==
              doctest::Approx(values[0] + values[1] + sign * values[2]).epsilon(1e-5));
        // That one, where it is, within what single precision leaves of it.
        const double gap = (values[1] + sign * values[2]) / values.norm();
        if (gap < 1e-3) continue;
        const Eigen::Matrix3d best =
            svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
        CHECK((rotation - best).norm() < std::max(1e-5, 2e-6 / gap));
    }
    CHECK(nearest(Eigen::Matrix3d::Zero()) == Eigen::Matrix3d::Identity());
}

}  // namespace defrec::test
