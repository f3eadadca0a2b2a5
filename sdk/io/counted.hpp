// A number with its noun in the singular or the plural.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace defrec::cli {

// "1 point", "0 points", "2 points of the plan". plural: where it is not the noun with an s at its
// end.
inline std::string counted(std::uint64_t count, std::string_view noun,
                           std::string_view plural = {}) {
    std::string text = std::to_string(count) + " ";
    if (count == 1) return text.append(noun);
    return plural.empty() ? text.append(noun) + "s" : text.append(plural);
}

}  // namespace defrec::cli
