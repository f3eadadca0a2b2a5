// Where the tolerances come from: how far the reference's own results spread when its inputs change
// by the least that single precision knows.
#pragma once
#include <string>

namespace defrec::conformance {

inline constexpr int kJitters = 16;   // of every case
inline constexpr double kMargin = 4;  // a tolerance is this many times the spread

// Prints, for every quantity of the float stages, the spread over all cases of the suite, four
// times that, and what the suite allows. For each jitter every float of a case's inputs goes up or
// down by one unit in the last place, or stays. backend: how far its results are from the
// reference's is printed too; may be empty. Throws Error if a plugin cannot be loaded.
void print_derived_tolerances(const std::string& backend);

}  // namespace defrec::conformance
