// The posterior of a motion and a shape, against the closed form of a normal distribution.
#include "sdk/registration/elastic/shape_posterior.hpp"

#include <doctest/doctest.h>

#include <Eigen/LU>
#include <random>

using namespace defrec;

namespace {

constexpr Eigen::Index kModes = 5, kRows = 40;
constexpr double kScale = 3;

struct Data {
    Eigen::MatrixXd rows;
    Eigen::VectorXd values;

    ShapeEquations equations() const {
        ShapeEquations made(kModes);
        const auto motion = rows.leftCols<6>();
        const auto shape = rows.rightCols(kModes);
        made.motion = motion.transpose() * motion;
        made.cross = motion.transpose() * shape;
        made.shape = shape.transpose() * shape;
        made.motion_right = motion.transpose() * values;
        made.shape_right = shape.transpose() * values;
        return made;
    }
};

Data drawn_data(const Eigen::VectorXd& truth, std::mt19937& random) {
    std::normal_distribution<double> normal;
    Data made;
    made.rows = Eigen::MatrixXd::NullaryExpr(kRows, 6 + kModes, [&] { return normal(random); });
    made.values = made.rows * truth;
    for (double& value : made.values) value += normal(random);
    return made;
}

}  // namespace

TEST_CASE("shapes of one stiffness: the posterior is that of a normal prior") {
    std::mt19937 random(4);
    const Data data = drawn_data(Eigen::VectorXd::LinSpaced(6 + kModes, -2, 2), random);
    const ShapePosterior found =
        posterior_of(data.equations(), Eigen::VectorXd::Constant(kModes, 7), kScale);
    Eigen::MatrixXd information = data.rows.transpose() * data.rows;
    information.bottomRightCorner(kModes, kModes).diagonal().array() += kModes / (kScale * kScale);
    const Eigen::MatrixXd covariance = information.inverse();
    const Eigen::VectorXd mean = covariance * (data.rows.transpose() * data.values);
    CHECK(found.covariance.isApprox(covariance, 1e-9));
    CHECK(found.motion.isApprox(mean.head<6>(), 1e-9));
    CHECK(found.shape.isApprox(mean.tail(kModes), 1e-9));
}

TEST_CASE("what data do not show keeps its prior, the softer the more") {
    std::mt19937 random(5);
    Data data = drawn_data(Eigen::VectorXd::Zero(6 + kModes), random);
    data.rows.rightCols(kModes).setZero();
    Eigen::VectorXd stiffness(kModes);
    stiffness << 1, 1.5, 2, 4, 8;
    const ShapePosterior found = posterior_of(data.equations(), stiffness, kScale);
    CHECK(found.shape.norm() < 1e-9);
    CHECK(found.covariance.bottomRightCorner(kModes, kModes).trace() ==
          doctest::Approx(kScale * kScale));
    for (Eigen::Index i = 1; i < kModes; ++i)
        CHECK(found.covariance(6 + i, 6 + i) < found.covariance(5 + i, 5 + i));
}

TEST_CASE("evidence: a shape that data show has much, one that they do not has none") {
    std::mt19937 random(6);
    Eigen::VectorXd truth = Eigen::VectorXd::Zero(6 + kModes);
    const Eigen::VectorXd stiffness = Eigen::VectorXd::LinSpaced(kModes, 1, 3);
    CHECK(posterior_of(drawn_data(truth, random).equations(), stiffness, kScale).evidence < 3);
    truth[6] = 2;
    CHECK(posterior_of(drawn_data(truth, random).equations(), stiffness, kScale).evidence > 10);
}
