// The list of the stage tier.
#include "conformance/cases/stage/stage_case.hpp"

namespace defrec::conformance {

void add_stage_cases(std::vector<Case>& cases) {
    add_rectify_cases(cases);
    add_stereo_cases(cases);
    add_orb_cases(cases);
}

}  // namespace defrec::conformance
