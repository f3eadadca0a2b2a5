// The CRC of MCAP files: that of zlib and of IEEE 802.3, polynomial 0xEDB88320 reflected.
#pragma once

#include <cstdint>

#include "sdk/bag/byte_reader.hpp"

namespace defrec::cli {

// crc: of the bytes before, 0 at the beginning.
std::uint32_t crc32(ByteView bytes, std::uint32_t crc = 0);

}  // namespace defrec::cli
