// The list of the stage tier.
#include "conformance/case.hpp"

namespace defrec::conformance {

void add_stage_cases(std::vector<Case>&) {}

}  // namespace defrec::conformance
