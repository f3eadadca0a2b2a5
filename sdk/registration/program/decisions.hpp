// The numbers by which `defrec register` decides, as in sdk/tracking/frame/decisions.hpp: unit |
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

}  // namespace defrec::decisions
