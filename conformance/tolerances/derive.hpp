// Where the tolerances come from: how far the reference's own results spread when its inputs change by the least that single
// precision knows.
#pragma once

namespace defrec::conformance {

inline constexpr int kJitters = 16;       // of every case
inline constexpr double kMargin = 4;      // a tolerance is this many times the spread

// Prints, for every quantity of the float stages, the spread over all cases of the suite and four times that. For each jitter every
// float of a case's inputs goes up or down by one unit in the last place, or stays. Throws Unavailable without the reference.
void print_derived_tolerances();

}  // namespace defrec::conformance
