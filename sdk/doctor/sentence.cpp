// Numbers in sentences.
#include "sdk/doctor/sentence.hpp"

#include "sdk/io/text.hpp"

namespace defrec::cli {

std::string decimals(double value, int count) { return format_fixed(value, count); }

std::string percent(double share) { return format_fixed(100 * share, 0).append(" %"); }

std::string of_frames(std::size_t count, std::size_t all) {
    return std::to_string(count).append(" of ").append(std::to_string(all)).append(" frames");
}

std::string size_text(int width, int height) {
    return std::to_string(width).append("x").append(std::to_string(height));
}

}  // namespace defrec::cli
