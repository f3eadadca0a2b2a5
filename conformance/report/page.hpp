// The page a person reads: one file, without network and readable without its script.
#pragma once
#include <string>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

// Texts must be valid (text.hpp). Throws ReportError for a picture that is none.
std::string page_html(const RunRecord& run);

}  // namespace defrec::conformance
