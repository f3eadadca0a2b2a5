// Numbers in sentences.
#pragma once

#include <cstddef>
#include <string>

namespace defrec::cli {

std::string decimals(double value, int count);
std::string percent(double share);
std::string of_frames(std::size_t count, std::size_t all);
std::string size_text(int width, int height);

}  // namespace defrec::cli
