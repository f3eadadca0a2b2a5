// For the tests of atomic_file.hpp.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/testing/test_files.hpp"

namespace defrec::test {

inline std::string text_of(const std::filesystem::path& path) {
    const std::vector<unsigned char> bytes = defrec::test::read_file(path);
    return {bytes.begin(), bytes.end()};
}

template <typename Function>
inline std::string failure_of(const Function& function) {
    try {
        function();
    } catch (const FileError& error) {
        return error.what();
    }
    return "no failure";
}

inline bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

inline std::size_t files_in(const std::filesystem::path& folder) {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace defrec::test
