// What backends that compute on the host tell of it: computer_posix.cpp, computer_windows.cpp.
#pragma once
#include <cstdint>
#include <string>

namespace defrec {

// The model of this computer's first processor; "Processor" where it is unknown.
std::string processor_name();
// Main memory, in bytes.
uint64_t memory_bytes();

}  // namespace defrec
