// Whether a file's bytes are a complete DLL: what the loader of Windows checks, whose messages do
// not say what is wrong, and that nothing of the file is cut off.
#pragma once
#include <cstdint>
#include <span>
#include <string>

namespace defrec {

// machine: of pe_format.hpp, the processor that it has to be made for. Throws
// Error(DEFREC_ERROR_PLUGIN) with the reason; path is for the text.
void check_dll(const std::string& path, std::span<const unsigned char> bytes, uint16_t machine);

}  // namespace defrec
