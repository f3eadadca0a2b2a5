// SHA-256 (FIPS 180-4).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace defrec {

// The sum of bytes that come in pieces.
class Sha256 {
  public:
    void add(std::span<const unsigned char> bytes);
    // 64 lower-case hexadecimal digits, once.
    std::string hex();

  private:
    std::array<uint32_t, 8> state_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    std::array<unsigned char, 64> rest_{};  // of a block
    uint64_t size_ = 0;                     // of all bytes so far
};

// 64 lower-case hexadecimal digits.
std::string sha256_hex(std::span<const unsigned char> bytes);

}  // namespace defrec
