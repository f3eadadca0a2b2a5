// The sum of both covariances against errors that are drawn, and what a plan may not hold. Through
// the C API: sdk/api/plan_test.cpp.
#include "sdk/plan/plan.hpp"

#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <random>

using namespace defrec;

namespace {

template <int N>
using Square = Eigen::Matrix<double, N, N>;

template <int N>
Square<N> random_covariance(std::mt19937& random, const Eigen::Matrix<double, N, 1>& deviations) {
    std::normal_distribution<double> normal;
    const Square<N> mixed =
        Square<N>::NullaryExpr([&] { return normal(random); }) / std::sqrt(double{N});
    return deviations.asDiagonal() * (mixed * mixed.transpose()) * deviations.asDiagonal();
}

// Errors with that covariance.
template <int N>
class Drawn {
  public:
    explicit Drawn(const Square<N>& covariance) : root_(covariance.llt().matrixL()) {}
    Eigen::Matrix<double, N, 1> operator()(std::mt19937& random) {
        return root_ * Eigen::Matrix<double, N, 1>::NullaryExpr([&] { return normal_(random); });
    }

  private:
    Square<N> root_;
    std::normal_distribution<double> normal_;
};

PlanData usable_data() {
    PlanData data;
    data.vertices = {0, 0, 0, 10, 0, 0, 0, 10, 0};
    data.triangles = {0, 1, 2};
    data.parts = {{"tumour", 0, 1}};
    data.targets = {1, 2, 3};
    data.covariance.diagonal() << 1e-4, 1e-4, 1e-4, 0.1, 0.1, 0.1;
    return data;
}

template <class Change>
std::string fault_after(const Change& change) {
    PlanData data = usable_data();
    change(data);
    return data.fault();
}

}  // namespace

// A pose that is off by a drawn twist takes the model's place elsewhere in the template, the tissue
// turns that by R, and tracking adds an error of its own.
TEST_CASE("the sum of both covariances is that of errors that are drawn") {
    std::mt19937 random(5);
    constexpr int kTrials = 20, kDraws = 20000;
    for (int trial = 0; trial < kTrials; ++trial) {
        Twist deviations;
        deviations << 0.01, 0.02, 0.005, 0.5, 0.2, 0.8;
        const TwistMatrix registration = random_covariance<6>(random, deviations);
        const Square<3> tracking = random_covariance<3>(random, {0.3, 0.2, 0.7});
        std::uniform_real_distribution<double> side(-50, 50);
        const auto place = [&] {
            return Eigen::Vector3d(side(random), side(random), side(random));
        };
        const Pose pose{defrec::rotation_of(place() / 20), place()};
        const Eigen::Vector3d in_model = place(), at_rest = pose * in_model;
        const Eigen::Matrix3d rotation = defrec::rotation_of(place() / 20);

        Drawn<6> twists(registration);
        Drawn<3> errors(tracking);
        Square<3> sum = Square<3>::Zero();
        for (int i = 0; i < kDraws; ++i) {
            const Pose truth = moved(pose, twists(random), Eigen::Vector3d::Zero());
            const Eigen::Vector3d error = rotation * (truth * in_model - at_rest) + errors(random);
            sum += error * error.transpose() / kDraws;
        }

        std::array<double, 6> formula{tracking(0, 0), tracking(0, 1), tracking(0, 2),
                                      tracking(1, 1), tracking(1, 2), tracking(2, 2)};
        add_registration_error(rotation, target_covariance(registration, at_rest), formula.data());
        const Eigen::Matrix3d expected = symmetric_matrix(formula.data());
        // 20,000 draws leave about 1 %, and turns of 0.02 rad are not quite small.
        CHECK((sum - expected).norm() < 0.05 * expected.norm());
        // Without the turn, or without the lever arm, it would not fit.
        CHECK((sum - tracking - target_covariance(registration, Eigen::Vector3d::Zero())).norm() >
              0.05 * expected.norm());
    }
}

TEST_CASE("data of a plan with a fault") {
    CHECK(usable_data().fault().empty());
    CHECK(PlanData{}.fault().empty());  // nothing is followed
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    CHECK(fault_after([](PlanData& data) { data.vertices[4] = std::nanf(""); }) ==
          "a vertex is not finite");
    CHECK(fault_after([](PlanData& data) { data.targets[2] = 1 / 0.0; }) ==
          "a target is not finite");
    CHECK(fault_after([](PlanData& data) { data.triangles[2] = 3; }) ==
          "a triangle has vertex 3, there are 3");
    CHECK(fault_after([](PlanData& data) { data.parts[0].name.clear(); }) ==
          "parts[0].name has 0 bytes, 1 to 255 expected");
    CHECK(fault_after([](PlanData& data) { data.parts[0].name.assign(256, 'a'); }) ==
          "parts[0].name has 256 bytes, 1 to 255 expected");
    CHECK(fault_after([](PlanData& data) { data.parts[0].triangle_count = 2; }) ==
          "parts[0] has 2 triangles from 0 on, there are 1");
    CHECK(fault_after([](PlanData& data) {
              data.parts[0].first_triangle = 1;
              data.parts[0].triangle_count = UINT64_MAX;
          }) == "parts[0] has 18446744073709551615 triangles from 1 on, there are 1");
    CHECK(fault_after([](PlanData& data) { data.targets.resize(3'000'000); }) ==
          "there are 1000003 vertices and targets, at most 1000000 expected");
    CHECK(fault_after([&](PlanData& data) { data.pose.translation.x() = kNaN; }) ==
          "transform is not finite");
    CHECK(fault_after([](PlanData& data) { data.pose.rotation *= 1.01; }) ==
          "transform is no rigid motion");
    CHECK(fault_after([](PlanData& data) { data.pose.rotation.row(0).fill(1e200); }) ==
          "transform is no rigid motion");
    CHECK(fault_after([](PlanData& data) { data.pose.rotation(2, 2) = -1; }) ==
          "transform is no rigid motion");
    CHECK(fault_after([&](PlanData& data) { data.covariance(1, 1) = kNaN; }) ==
          "covariance is not finite");
    CHECK(fault_after([](PlanData& data) { data.covariance(0, 1) = 0.01; }) ==
          "covariance is not symmetric");
    CHECK(fault_after([](PlanData& data) { data.covariance(0, 0) = -1e-4; }) ==
          "covariance has a negative variance");
    CHECK(fault_after([](PlanData& data) {
              data.covariance(0, 1) = data.covariance(1, 0) = 2e-4;
          }) == "covariance is none: element 0, 1 is larger than its variances allow");
    CHECK(fault_after([](PlanData& data) {
              for (int i = 0; i < 3; ++i)
                  for (int j = 0; j < 3; ++j)
                      if (i != j) data.covariance(i, j) = -0.9e-4;
          }) == "covariance is none: it has a negative eigenvalue");
    CHECK(fault_after([](PlanData& data) {
              data.pose.translation.x() = 1e308;
              data.targets[0] = 1.7e308;
              data.covariance.setZero();
              data.vertices.clear(), data.triangles.clear(), data.parts.clear();
          }) == "target 0 has no finite place and error in the template");
    const auto deformed_fault = [](const auto& change) {
        return fault_after([&](PlanData& data) {
            data.deformed_places.assign(12, 1);
            for (int i = 0; i < 4; ++i)
                data.deformed_covariances.insert(data.deformed_covariances.end(),
                                                 {0.2, 0.1, 0, 0.3, 0, 0.4});
            change(data);
        });
    };
    CHECK(deformed_fault([](PlanData&) {}).empty());
    CHECK(deformed_fault([](PlanData& data) { data.deformed_places.pop_back(); }) ==
          "there are 11 coordinates and 24 numbers of covariances of deformed points, 12 and 24 "
          "expected");
    CHECK(deformed_fault([](PlanData& data) { data.deformed_covariances.clear(); }) ==
          "there are 12 coordinates and 0 numbers of covariances of deformed points, 12 and 24 "
          "expected");
    CHECK(deformed_fault([&](PlanData& data) { data.deformed_places[5] = kNaN; }) ==
          "a deformed point is not finite");
    CHECK(deformed_fault([](PlanData& data) { data.deformed_covariances[9] = -1; }) ==
          "deformed point 1 has a covariance that is none");
    CHECK(deformed_fault([](PlanData& data) { data.deformed_covariances[19] = 0.5; }) ==
          "deformed point 3 has a covariance that is none");
    CHECK(fault_after([](PlanData& data) { data.vertices[3] = 3e38F, data.covariance *= 1e300; }) ==
          "vertex 1 has no finite place and error in the template");
}

// Variances that a division does not survive, and none where something else of its row is: found
// by the fuzz target of plan files.
TEST_CASE("a covariance whose error would be no number is refused") {
    for (const double variance : {0.0, 5e-313}) {
        CHECK(fault_after([&](PlanData& data) {
                  data.covariance(4, 4) = variance;
                  data.covariance(0, 4) = data.covariance(4, 0) = 2e-3;
              }) == "covariance is none: element 0, 4 is larger than its variances allow");
        CHECK(fault_after([&](PlanData& data) {
                  data.covariance.diagonal().fill(variance);
              }).empty());
    }
}

TEST_CASE("a registration without error has errors of 0") {
    PlanData data = usable_data();
    data.covariance.setZero();
    CHECK(data.fault().empty());
}
