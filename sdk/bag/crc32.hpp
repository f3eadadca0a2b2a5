// The CRC of MCAP files, which is zlib's.
#pragma once

#include <zlib.h>

#include <cstdint>

#include "sdk/bag/byte_reader.hpp"

namespace defrec::cli {

// crc: of the bytes before, 0 at the beginning.
inline std::uint32_t crc32(ByteView bytes, std::uint32_t crc = 0) {
    if (bytes.empty()) return crc;  // zlib takes a null pointer for a request to begin
    return static_cast<std::uint32_t>(crc32_z(crc, bytes.data(), bytes.size()));
}

}  // namespace defrec::cli
