#include "conformance/report/revision.hpp"

#include "conformance/report/revision_value.hpp"

namespace defrec::conformance {

Revision suite_revision() { return {DEFREC_SUITE_REVISION, DEFREC_SUITE_DIRTY}; }

}  // namespace defrec::conformance
