// Text from plugins, drivers and systems, made fit for JSON, XML and HTML.
#pragma once
#include <string>
#include <string_view>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

// Valid UTF-8 without the control characters that XML forbids; what is not becomes U+FFFD.
std::string valid_text(std::string_view text);
// The same for every string of a record.
RunRecord with_valid_text(RunRecord run);

}  // namespace defrec::conformance
