// Numbers in sentences.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/io/text.hpp"

namespace defrec::cli {

std::string percent(double share);
std::string of_frames(std::size_t count, std::size_t all);
// "frames 20 to 22, 30" of ascending ones; of many ranges the first ones.
std::string frame_ranges(const std::vector<std::int64_t>& frames);

}  // namespace defrec::cli
