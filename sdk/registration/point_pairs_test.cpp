// Registration by pairs of points: how exact, what is expected of it, and what is refused.
#include "sdk/registration/point_pairs.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <random>
#include <string>
#include <vector>

#include "sdk/base/util/error.hpp"
#include "sdk/registration/test_organ.hpp"
#include "sdk/testing/check_says.hpp"

using namespace defrec;

namespace {

const Pose kTruth{rotation_of({0.3, -0.8, 1.9}), {20, -35, 110}};

std::vector<PointPair> pairs_at(const std::vector<Eigen::Vector3d>& places) {
    std::vector<PointPair> pairs;
    for (const Eigen::Vector3d& place : places) {
        PointPair pair;
        pair.model = place;
        pair.seen = kTruth * place;
        pairs.push_back(pair);
    }
    return pairs;
}

const std::vector<Eigen::Vector3d> kPlaces = {{0, 0, 0},     {80, 5, -10},  {10, 60, 20},
                                              {-40, 30, 35}, {30, -50, 15}, {-60, -20, -25}};

std::string refusal_of(const std::vector<PointPair>& pairs) {
    try {
        register_pairs(pairs);
    } catch (const Error& error) {
        CHECK(error.status() == DEFREC_ERROR_ARGUMENT);
        return error.what();
    }
    return "accepted";
}

}  // namespace

TEST_CASE("exact pairs give the exact pose, with and without stated errors") {
    std::vector<PointPair> pairs = pairs_at(kPlaces);
    for (const bool is_stated : {false, true}) {
        CAPTURE(is_stated);
        if (is_stated)
            for (PointPair& pair : pairs)
                pair.seen_covariance = Eigen::Vector3d(0.04, 0.04, 0.25).asDiagonal();
        const Registration found = register_pairs(pairs);
        CHECK(found.verdict == RegistrationVerdict::kRegistered);
        CHECK(found.pose.rotation.isApprox(kTruth.rotation, 1e-9));
        CHECK((found.pose.translation - kTruth.translation).norm() < 1e-7);
        CHECK(found.residuals.rms_mm < 1e-7);
        CHECK(found.free.empty());
    }
}

TEST_CASE("whole covariances are used: the answer is better than with equal weights") {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    double weighted = 0, alike = 0;
    for (int trial = 0; trial < 60; ++trial) {
        std::vector<PointPair> pairs = pairs_at(kPlaces);
        for (size_t i = 0; i < pairs.size(); ++i) {
            // Exact along different axes, and not at all along the others.
            Eigen::Vector3d sigma(2, 2, 2);
            sigma[static_cast<Eigen::Index>(i % 3)] = 0.1;
            pairs[i].seen_covariance = sigma.cwiseAbs2().asDiagonal();
            for (int axis = 0; axis < 3; ++axis)
                pairs[i].seen[axis] += sigma[axis] * normal(random);
        }
        weighted += (register_pairs(pairs).pose * kPlaces[1] - kTruth * kPlaces[1]).norm();
        for (PointPair& pair : pairs) pair.seen_covariance.setIdentity();
        alike += (register_pairs(pairs).pose * kPlaces[1] - kTruth * kPlaces[1]).norm();
    }
    CHECK(weighted < 0.7 * alike);
}

TEST_CASE("errors of a target are as large as expected, of stated and of unknown errors") {
    const Eigen::Vector3d target(15, 25, 60);
    for (const bool is_stated : {false, true})
        for (const size_t count : {size_t{4}, size_t{6}}) {
            CAPTURE(is_stated);
            CAPTURE(count);
            std::mt19937 random(7);
            std::normal_distribution<double> normal;
            constexpr int kTrials = 400;
            int within_2 = 0, within_3 = 0;
            double squared = 0, expected = 0;
            for (int trial = 0; trial < kTrials; ++trial) {
                std::vector<PointPair> pairs =
                    pairs_at({kPlaces.begin(), kPlaces.begin() + std::ptrdiff_t(count)});
                for (PointPair& pair : pairs) {
                    if (is_stated) pair.seen_covariance = Eigen::Matrix3d::Identity();
                    for (int axis = 0; axis < 3; ++axis) pair.seen[axis] += normal(random);
                }
                const Registration found = register_pairs(pairs);
                const double error = (found.pose * target - kTruth * target).norm();
                const double variance = found.placed(target).covariance.trace();
                squared += error * error;
                expected += variance;
                within_2 += error <= 2 * std::sqrt(variance);
                within_3 += error <= 3 * std::sqrt(variance);
            }
            CHECK(within_2 >= 0.93 * kTrials);
            CHECK(within_3 >= 0.985 * kTrials);
            if (is_stated) CHECK(squared == doctest::Approx(expected).epsilon(0.35));
        }
}

TEST_CASE("row 172: pairs in a line leave the turn about it open") {
    const Registration found =
        register_pairs(pairs_at({{0, 0, 0}, {20, 10, 5}, {40, 20, 10}, {100, 50, 25}}));
    CHECK(found.verdict == RegistrationVerdict::kUndetermined);
    REQUIRE(found.free.size() == 1);
    CHECK(found.free[0].is_turn);
    const Eigen::Vector3d along = kTruth.rotation * Eigen::Vector3d(20, 10, 5).normalized();
    CHECK(std::abs(found.free[0].axis.dot(along)) > 0.9999);
    // The axis passes through the pairs.
    const Eigen::Vector3d from_pair = kTruth * Eigen::Vector3d(0, 0, 0) - found.free[0].point;
    CHECK((from_pair - along * along.dot(from_pair)).norm() < 0.01);
    CHECK_SAYS(found.reason, "turn about the axis");
    CHECK(std::sqrt(found.placed({50, -50, 0}).covariance.trace()) > 100);
}

TEST_CASE("row 172: pairs at one place leave every turn open") {
    const Registration found = register_pairs(pairs_at({{5, 5, 5}, {5, 5, 5}, {5, 5, 5}}));
    CHECK(found.verdict == RegistrationVerdict::kUndetermined);
    CHECK(found.free.size() == 3);
}

TEST_CASE("row 173: a pair that contradicts the others is named") {
    std::vector<PointPair> pairs = pairs_at(kPlaces);
    for (PointPair& pair : pairs) pair.seen_covariance = 0.25 * Eigen::Matrix3d::Identity();
    pairs[2].seen += Eigen::Vector3d(0, 4, 2);
    const Registration found = register_pairs(pairs);
    CHECK(found.verdict == RegistrationVerdict::kFailed);
    CHECK_SAYS(found.reason, "pair 2 contradicts the others");
    CHECK(found.is_inlier[2] == 0);
    std::swap(pairs[0].seen, pairs[1].seen);
    const Registration exchanged = register_pairs(pairs);
    CHECK(exchanged.verdict == RegistrationVerdict::kFailed);
    CHECK_SAYS(exchanged.reason, "do not fit each other");
}

TEST_CASE("row 170: pairs that are refused, each with the reason") {
    std::vector<PointPair> pairs = pairs_at(kPlaces);
    CHECK_SAYS(refusal_of({pairs[0], pairs[1]}), "2 pairs were given, expected 3 at least");
    pairs[1].seen.x() = std::numeric_limits<double>::infinity();
    CHECK_SAYS(refusal_of(pairs), "pair 1 has a coordinate that is not finite");
    pairs = pairs_at(kPlaces);
    pairs[3].seen_covariance = Eigen::Vector3d(1, 1, -1).asDiagonal();
    CHECK_SAYS(refusal_of(pairs), "pair 3: the covariance of its seen place is none");
    pairs[3].seen_covariance.setIdentity();
    CHECK_SAYS(refusal_of(pairs), "the errors of 1 of 6 pairs are stated");
}
