// The transform from relative motions in closed form (F. Park, B. Martin, "Robot sensor
// calibration: solving AX=XB on the Euclidean group", IEEE T-RA 10(5), 1994), and with outliers: of
// the transforms from many small subsets the one with the least median of errors (P. Rousseeuw,
// "Least median of squares regression", JASA 79, 1984).
#pragma once
#include <optional>
#include <vector>

#include "sdk/hand_eye/hand_eye_pair.hpp"

namespace defrec {

// From all relative motions of these pairs, but for those whose rotation is too small or too large;
// of many pairs some are used, evenly spread. Empty where none is left.
std::optional<HandEyeTransforms> closed_form(const HandEyePairs& pairs);

struct HandEyeStartFit {
    HandEyeTransforms transforms;
    double median = 0;  // of the errors, in expected errors; infinite where there is no transform
};

// Half of the pairs at most may be wrong.
HandEyeStartFit robust_start(const HandEyePairs& pairs, const HandEyeNoise& noise);

// The factor by which the world's lengths are to be multiplied to have those of the tracking
// system; 0 where the motions do not tell.
double length_factor(const HandEyePairs& pairs);

}  // namespace defrec
