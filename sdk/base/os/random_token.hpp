// Names that nobody guesses, and that no two runs share.
#pragma once
#include <cstdint>
#include <random>
#include <string>

namespace defrec {

// 128 bits from the system's source of randomness, as 32 lower-case hexadecimal digits.
inline std::string random_token() {
    std::random_device source;
    std::string token;
    constexpr char kDigits[] = "0123456789abcdef";
    for (int i = 0; i < 4; ++i) {
        std::uint32_t bits = source();
        for (int digit = 0; digit < 8; ++digit, bits >>= 4) token += kDigits[bits & 15];
    }
    return token;
}

}  // namespace defrec
