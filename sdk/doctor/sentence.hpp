// Numbers in sentences.
#pragma once

#include <cstddef>
#include <string>

#include "sdk/io/text.hpp"

namespace defrec::cli {

std::string percent(double share);
std::string of_frames(std::size_t count, std::size_t all);

}  // namespace defrec::cli
