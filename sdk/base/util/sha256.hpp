// SHA-256 (FIPS 180-4) of bytes in memory.
#pragma once
#include <span>
#include <string>

namespace defrec {

// 64 lower-case hexadecimal digits.
std::string sha256_hex(std::span<const unsigned char> bytes);

}  // namespace defrec
