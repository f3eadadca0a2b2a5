// How many neighbouring residuals have one error in common.
#pragma once
#include <Eigen/Core>
#include <span>

namespace defrec {

// The factor by which errors that are alike in neighbours raise the variance of a mean (the design
// effect): 1 for independent ones. places: mm; values: one each, mean 0.
double design_effect(std::span<const Eigen::Vector3d> places, std::span<const double> values);

}  // namespace defrec
