// The run as JUnit XML, the form that build servers show: one testsuite for each tier.
#pragma once
#include <string>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

// Texts must be valid (text.hpp).
std::string junit_xml(const RunRecord& run);

}  // namespace defrec::conformance
