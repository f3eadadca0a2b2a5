// Whether expected errors tell good points from bad ones: sparsification curves and the area
// between them (Ilg et al. 2018, "Uncertainty estimates and multi-hypotheses networks for optical
// flow").
#pragma once

#include <vector>

#include "sdk/evaluation/score/coverage.hpp"

namespace defrec::cli {

// Element k is the mean error of what is left without the k worst of n samples, divided by the
// mean error of all; 0 where that is 0. Both have n elements.
struct Sparsification {
    std::vector<double> by_expected;  // the worst by expected error; the mean over all orders of
                                      // samples with the same expected error
    std::vector<double> by_true;      // the worst by true error, the lowest curve possible
};
// Curves of the samples with an expected error.
Sparsification sparsification_of(const std::vector<ErrorSample>& samples);

// The area between the curves over the share removed, 0..1: the mean of their difference. 0 for the
// right order; NaN for none.
double ause_of(const Sparsification& curves);

}  // namespace defrec::cli
