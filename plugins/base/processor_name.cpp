// See processor_name.hpp.
#include "plugins/base/processor_name.hpp"

#include <string_view>

namespace defrec {

std::string processor_name(std::istream& cpuinfo) {
    constexpr std::string_view kKey = "model name", kBlank = " \t";
    for (std::string line; std::getline(cpuinfo, line);) {
        const size_t colon = line.find(':');
        if (colon == std::string::npos || line.compare(0, kKey.size(), kKey) != 0) continue;
        const size_t first = line.find_first_not_of(kBlank, colon + 1);
        if (first == std::string::npos) continue;
        return line.substr(first, line.find_last_not_of(kBlank) + 1 - first);
    }
    return "Processor";
}

}  // namespace defrec
