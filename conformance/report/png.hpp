// A picture as a PNG file.
#pragma once
#include <cstdint>
#include <vector>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

// Throws ReportError for a picture whose pixels do not fit its size.
std::vector<uint8_t> png_of(const Picture& picture);

}  // namespace defrec::conformance
