// Which basis past errors speak for, and how they are remembered.
#include "sdk/predictor/prediction_errors.hpp"

#include <doctest/doctest.h>

using namespace defrec;

namespace {

constexpr double kFrame = 1.0 / 30;

void repeat(PredictionErrors& errors, const ByBasis& means, int frames) {
    for (int i = 0; i < frames; ++i) errors.add_means(means, means, kFrame);
}

}  // namespace

TEST_CASE("before anything was judged the last basis counts, with the error of unknown motion") {
    const PredictionErrors errors(3, 2 * kFrame);
    for (const Basis basis : {Basis::kLast, Basis::kVelocity, Basis::kLearned}) {
        CHECK(errors.best(basis) == basis);
        CHECK(errors.mean(basis) == doctest::Approx(4));  // 30 mm/s for 1/15 s
    }
    CHECK(errors.own(2) == 0);
}

TEST_CASE("the basis that erred least lately counts, of those that a point allows") {
    PredictionErrors errors(1, kFrame);
    repeat(errors, {4, 1, 0.25}, 10);
    CHECK(errors.best(Basis::kLearned) == Basis::kLearned);
    CHECK(errors.best(Basis::kVelocity) == Basis::kVelocity);
    CHECK(errors.best(Basis::kLast) == Basis::kLast);
    CHECK(errors.mean(Basis::kLearned) == doctest::Approx(0.25));
    repeat(errors, {0.5, 1, 2}, 60);
    CHECK(errors.best(Basis::kLearned) == Basis::kLast);
    CHECK(errors.best(Basis::kVelocity) == Basis::kLast);
    repeat(errors, {0.5, 0.1, 2}, 60);
    CHECK(errors.best(Basis::kLearned) == Basis::kVelocity);
}

TEST_CASE("a single bad frame is soon in the error, and does not change the basis") {
    PredictionErrors errors(1, kFrame);
    repeat(errors, {4, 1, 0.25}, 60);
    errors.add_means({4, 1, 4}, {4, 1, 4}, kFrame);
    CHECK(errors.best(Basis::kLearned) == Basis::kLearned);
    CHECK(errors.mean(Basis::kLearned) == doctest::Approx(0.25 + 0.2 * 3.75).epsilon(0.01));
}

TEST_CASE("a point's own errors: the first as it is, then a mean; a gap is no long time") {
    PredictionErrors errors(2, kFrame);
    errors.add_own(1, 9, kFrame);
    CHECK(errors.own(1) == 9);
    CHECK(errors.own(0) == 0);
    errors.add_own(1, 0, kFrame);
    CHECK(errors.own(1) == doctest::Approx(8.1).epsilon(0.01));
    errors.add_own(1, 0, 1000);
    CHECK(errors.own(1) > 5);
}
