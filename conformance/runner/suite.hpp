// The suite as reports are held against it.
#pragma once
#include "conformance/report/verify.hpp"

namespace defrec::conformance {

// Every case of this program, and the limits of tolerances.yaml: what a metric is called is the
// name of its tolerance; one without a tolerance is exact.
Suite this_suite();

}  // namespace defrec::conformance
