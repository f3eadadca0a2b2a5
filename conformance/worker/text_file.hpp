// What system files say of the machine.
#pragma once
#include <string>

namespace defrec::conformance {

// What stands behind the key in the first line of a file that begins with it; empty if none does.
std::string value_in(const char* path, const std::string& key);

}  // namespace defrec::conformance
