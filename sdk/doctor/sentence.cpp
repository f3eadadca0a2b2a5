// Numbers in sentences.
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {

std::string percent(double share) { return format_fixed(100 * share, 0).append(" %"); }

std::string of_frames(std::size_t count, std::size_t all) {
    return std::to_string(count).append(" of ").append(std::to_string(all)).append(" frames");
}

}  // namespace defrec::cli
