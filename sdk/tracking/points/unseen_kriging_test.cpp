// Weights that are changed give what the same weights give from the start.
#include "sdk/tracking/points/unseen_kriging.hpp"

#include <doctest/doctest.h>

#include <random>
#include <vector>

using namespace defrec;

namespace {

constexpr Eigen::Index kPlaces = 30, kModes = 8;

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, uint32_t seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

UnseenKriging kriging(const Eigen::VectorXd& weight) {
    const Eigen::MatrixXd root = random_matrix(3 * kModes, 3 * kModes, 1);
    UnseenKriging kriging({random_matrix(kPlaces, kModes, 2), 20 * random_matrix(3, kPlaces, 3)},
                          root * root.transpose());
    kriging.weigh(weight);
    return kriging;
}

// Place 0 is known no more, 1 less well, 2 newly, and 3 much better.
Eigen::VectorXd weights_before() {
    Eigen::VectorXd weight = Eigen::VectorXd::LinSpaced(kPlaces, 1, 9);
    weight[2] = 0;
    return weight;
}
Eigen::VectorXd weights_after() {
    Eigen::VectorXd weight = weights_before();
    weight[0] = 0;
    weight[1] = 0.01;
    weight[2] = 5;
    weight[3] = 400;
    return weight;
}

struct Changed {
    UnseenKriging as_changed = kriging(weights_before()), anew = kriging(weights_after());

    Changed() {
        as_changed.find_doubts();
        as_changed.find_covariance();
        as_changed.change(std::vector<Eigen::Index>{0, 1, 2, 3}, weights_after());
        anew.find_doubts();
    }
};

const Eigen::Matrix3Xd kDisplacements = random_matrix(3, kPlaces, 4);

}  // namespace

TEST_CASE("changed weights: coefficients and motion are those of weights found anew") {
    const Changed changed;
    const UnseenKriging::Found a = changed.as_changed.solve(kDisplacements),
                               b = changed.anew.solve(kDisplacements),
                               before = kriging(weights_before()).solve(kDisplacements);
    CHECK((a.coefficients - b.coefficients).norm() < 1e-9 * b.coefficients.norm());
    CHECK((a.motion - b.motion).norm() < 1e-9 * b.motion.norm());
    CHECK((before.coefficients - b.coefficients).norm() > 0.01 * b.coefficients.norm());
}

TEST_CASE("changed weights: variances are those of weights found anew") {
    const Changed changed;
    const DisplacementModel other(random_matrix(5, kModes, 5), 20 * random_matrix(3, 5, 6));
    const Eigen::VectorXd a = changed.as_changed.variances(other) -
                              changed.as_changed.lessened(other),
                          b = changed.anew.variances(other);
    CHECK((a - b).norm() < 1e-9 * b.norm());
    CHECK(changed.anew.lessened(other).norm() == 0);
}

TEST_CASE("changed weights: a changed place stands out as it does with weights found anew") {
    const Changed changed;
    const auto surprises = [](const UnseenKriging& of) {
        return of.surprises(kDisplacements, of.solve(kDisplacements));
    };
    const Eigen::VectorXd a = surprises(changed.as_changed), b = surprises(changed.anew);
    CHECK(a[0] == 0);
    for (Eigen::Index place = 1; place < 4; ++place)
        CHECK(a[place] == doctest::Approx(b[place]).epsilon(1e-6));
}

TEST_CASE("without information the numbers that are found are no numbers") {
    UnseenKriging none({random_matrix(kPlaces, kModes, 2), 20 * random_matrix(3, kPlaces, 3)},
                       -Eigen::MatrixXd::Identity(3 * kModes, 3 * kModes));
    none.weigh(Eigen::VectorXd::Zero(kPlaces));
    CHECK_FALSE(none.solve(kDisplacements).coefficients.allFinite());
}

TEST_CASE("no weight is changed, after some were") {
    Changed changed;
    changed.as_changed = kriging(weights_before());
    changed.as_changed.find_covariance();
    changed.as_changed.change({}, weights_before());
    const UnseenKriging::Found a = changed.as_changed.solve(kDisplacements),
                               b = kriging(weights_before()).solve(kDisplacements);
    CHECK(a.coefficients == b.coefficients);
    CHECK(a.motion == b.motion);
}

TEST_CASE("no place has no variance") {
    const Changed changed;
    const DisplacementModel none(Eigen::MatrixXd(0, kModes), Eigen::Matrix3Xd(3, 0));
    CHECK(changed.as_changed.variances(none).size() == 0);
    CHECK(changed.as_changed.lessened(none).size() == 0);
}
