// The numbers by which `defrec register` decides, as scripts/decisions/header.py reads them: unit |
// what it decides | source.
#pragma once

#include <cstddef>

namespace defrec::decisions {

// The files that `defrec register` reads.
struct RegisterInputs {
    // targets | more are refused | as of `defrec track`
    static constexpr std::size_t kMaxTargets = 100000;
    // share of the mean square | in either direction across the line of sight, where an expected
    //   error stands for a covariance | depth is less exact than direction
    static constexpr double kAcrossShare = 0.02;
    // 1 | an element of R R^T - 1 of a start, at most | files round to six digits
    static constexpr double kMaxRotationError = 1e-3;
    // bytes | of a file with a start, at most | set by hand
    static constexpr std::size_t kMaxPoseBytes = 100000000;
};

// What is said of units and axes where a registration fails.
struct LikelyCauses {
    // factor | lengths whose ratio is a unit but for it differ by that unit | set by hand
    static constexpr double kSameLength = 1.5;
    // of the surface's longest side | a model that is smaller has another unit | what is seen of an
    //   organ is a part of it; outliers lie beside it
    static constexpr double kLeastShare = 0.4;
    // of the surface's longest side | a model that is larger has another unit, or the surface has |
    //   a tenth of an organ is the least that is registered
    static constexpr double kMostTimes = 20;
    // times | nearer are pairs with an axis turned round, if that is the cause | set by hand
    static constexpr double kFarBetter = 4;
    // mm | pairs that are nearer fit as they are | as `--max-residual` of pairs
    static constexpr double kLeastOff = 5;
    // of the model's longest side | pairs that are nearer to its vertices are of it | set by hand
    static constexpr double kBesideModel = 0.05;
    // of the model's longest side | pairs that are farther from its vertices are not of it | set by
    //   hand: landmarks lie beside an organ as well
    static constexpr double kFarFromModel = 0.3;
    // pairs | that are looked at | each is compared with all vertices
    static constexpr long kMostPairs = 200;
};

// What is said of targets that do not belong to the model.
struct DoubtfulTargets {
    // mm | beside the box around the model: farther targets are not of it | set by hand: a surface
    //   that is open has targets beneath it
    static constexpr double kBesideModel = 60;
    // mm | and beside that around the landmarks, where there is no model | these may be of a part
    static constexpr double kBesidePairs = 100;
    // of the longest side | beside the box: targets that a change puts there speak for it most |
    // set
    //   by hand
    static constexpr double kNextTo = 0.1;
    // of the longest side and what may be beside it | nearer to the origin are all targets in
    // metres
    //   | a thousandth, and as much again for the origin's place
    static constexpr double kOnePoint = 0.002;
};

// Pairs as evidence beside a surface.
struct PairsWithSurface {
    // pairs | of fewer none is left out | the other four still show whether they agree
    static constexpr std::size_t kMinPairs = 5;
    // pairs | of more none is left out | each is left out once, in the square of their number
    static constexpr std::size_t kMaxPairs = 200;
    // 1 | probability by chance of what is taken for a contradiction, at most | that of
    //   RegistrationPairs
    static constexpr double kChance = 1.0 / 1500;
    // mm^2 | variance of pairs that agree exactly | rounding
    static constexpr double kMinVariance = 1e-4;
    // expected errors | a pair that is farther off does not fit | as RegistrationPairs
    static constexpr double kMaxRatio = 4;
    // times | the surface is compared where both put the model | set by hand: the pairs alone may
    // be
    //   off by what the surface holds better
    static constexpr int kRounds = 2;
};

}  // namespace defrec::decisions
