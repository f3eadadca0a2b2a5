// Registration by pairs of points: a place of the model and where it is seen.
#pragma once
#include <Eigen/Core>
#include <span>

#include "sdk/registration/registration.hpp"

namespace defrec {

struct PointPair {
    Eigen::Vector3d model, seen;  // mm, in either frame
    // mm^2, of either place in its own frame; both 0 for all pairs: the errors are not known, and
    // alike.
    Eigen::Matrix3d model_covariance = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d seen_covariance = Eigen::Matrix3d::Zero();
};

struct PairOptions {
    double max_error_mm;     // a motion that is less exact is undetermined
    double max_residual_mm;  // a registration with a larger root mean square has failed
    PairOptions();           // defaults of defrec_registration_pairs
};

// Throws Error(DEFREC_ERROR_ARGUMENT) for fewer than three pairs, numbers that are not finite,
// places farther than 1 km, and covariances that are none, or known of some pairs alone. A pair
// that contradicts the others, or pairs in a line, are told by the verdict. residual_mm: the length
// of each pair's residual; is_inlier: 0 for pairs that contradict.
Registration register_pairs(std::span<const PointPair> pairs, const PairOptions& options = {});

}  // namespace defrec
