// See crc32.hpp. Eight bytes at a time, by tables (Kounavis and Berry, "A systematic approach to
// building high performance software-based CRC generators", ISCC 2005).
#include "sdk/bag/crc32.hpp"

#include <array>
#include <cstddef>

namespace defrec::cli {
namespace {

constexpr std::size_t kSlices = 8;
using Tables = std::array<std::array<std::uint32_t, 256>, kSlices>;

constexpr Tables make_tables() {
    constexpr std::uint32_t kPolynomial = 0xEDB88320;
    Tables tables{};
    for (std::uint32_t byte = 0; byte < tables[0].size(); ++byte) {
        std::uint32_t crc = byte;
        for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? kPolynomial : 0);
        tables[0][byte] = crc;
    }
    for (std::size_t slice = 1; slice < kSlices; ++slice)
        for (std::size_t byte = 0; byte < tables[0].size(); ++byte) {
            const std::uint32_t before = tables[slice - 1][byte];
            tables[slice][byte] = (before >> 8) ^ tables[0][before & 0xFF];
        }
    return tables;
}

constexpr Tables kTables = make_tables();

}  // namespace

std::uint32_t crc32(ByteView bytes, std::uint32_t crc) {
    crc = ~crc;
    for (; bytes.size() >= kSlices; bytes = bytes.subspan(kSlices)) {
        std::uint32_t next = 0;
        for (std::size_t i = 0; i < kSlices; ++i) {
            const std::uint32_t mixed = i < 4 ? (crc >> (8 * i)) & 0xFF : 0;
            next ^= kTables[kSlices - 1 - i][bytes[i] ^ mixed];
        }
        crc = next;
    }
    for (const unsigned char byte : bytes) crc = (crc >> 8) ^ kTables[0][(crc ^ byte) & 0xFF];
    return ~crc;
}

}  // namespace defrec::cli
