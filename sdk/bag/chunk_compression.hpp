// How chunks of MCAP files are compressed: not at all, LZ4 frames, or Zstandard.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/bag/byte_reader.hpp"

namespace defrec::cli {

// Fills `out` with the `size` bytes that `packed` holds. Memory grows with what comes out, and not
// with what the chunk claims. Empty, or what is wrong, as a sentence's end: "is compressed by ...".
std::string unpack(std::string_view compression, ByteView packed, std::size_t size,
                   std::vector<unsigned char>& out);

}  // namespace defrec::cli
