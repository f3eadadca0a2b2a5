// See text_file.hpp.
#include "conformance/worker/text_file.hpp"

#include <fstream>

namespace defrec::conformance {

std::string value_in(const char* path, const std::string& key) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        if (!line.starts_with(key)) continue;
        const size_t start = line.find_first_not_of(" \t:=\"", key.size());
        const size_t end = line.find_last_not_of(" \t\"");
        return start == std::string::npos ? "" : line.substr(start, end + 1 - start);
    }
    return "";
}

}  // namespace defrec::conformance
