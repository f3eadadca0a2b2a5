// Coefficients are learned, and forgotten.
#include "sdk/predictor/lag_model.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "sdk/predictor/decisions.hpp"

using namespace defrec;

namespace {

constexpr double kStep = 1.0 / 30;
constexpr int kLags = decisions::PredictionGrid::kLags;

// A frame of equations that the coefficients satisfy, but for noise.
void learn(LagModel& model, const Eigen::VectorXd& coefficients, std::mt19937& random) {
    std::normal_distribution<double> normal(0, 1);
    const Eigen::MatrixXd motions =
        Eigen::MatrixXd::NullaryExpr(kLags, 60, [&] { return normal(random); });
    Eigen::VectorXd reached = motions.transpose() * coefficients;
    for (double& value : reached) value += 0.01 * normal(random);
    model.forget(kStep);
    model.learn(motions, reached);
}

Eigen::VectorXd coefficients_of(double first, double last) {
    Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(kLags);
    coefficients[0] = first;
    coefficients[kLags - 1] = last;
    return coefficients;
}

}  // namespace

TEST_CASE("before anything is learned it is the damped velocity") {
    LagModel model(2, kStep);
    const double damped = 4 * (1 - std::exp(-2 / 4.0));
    CHECK(LagModel::damped(2, kStep) == doctest::Approx(damped));
    CHECK((model.coefficients() - coefficients_of(damped, 0)).norm() < 1e-12);
    model.solve();
    CHECK((model.coefficients() - coefficients_of(damped, 0)).norm() < 1e-12);
    CHECK(LagModel::damped(1, kStep) < 1);
    CHECK(LagModel::damped(60, kStep) == doctest::Approx(4));
}

TEST_CASE("coefficients are found, and give way to others") {
    std::mt19937 random(5);
    LagModel model(1, kStep);
    const Eigen::VectorXd before = coefficients_of(1.5, -0.4), after = coefficients_of(-0.7, 0.3);
    for (int frame = 0; frame < 90; ++frame) learn(model, before, random);
    model.solve();
    CHECK((model.coefficients() - before).cwiseAbs().maxCoeff() < 0.01);
    for (int frame = 0; frame < 240; ++frame) learn(model, after, random);  // 8 s
    model.solve();
    CHECK((model.coefficients() - after).cwiseAbs().maxCoeff() < 0.03);
}
