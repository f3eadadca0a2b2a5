// The list of the abi tier.
#include "conformance/cases/abi/abi.hpp"

namespace defrec::conformance {

void add_abi_cases(std::vector<Case>& cases) { add_abi_entry_cases(cases); }

}  // namespace defrec::conformance
