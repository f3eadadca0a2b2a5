// See stdio_file.hpp.
#include <unistd.h>

#include <cerrno>

#include "sdk/base/os/stdio_file.hpp"

namespace defrec {

std::FILE* create_file(const std::filesystem::path& path) {
    return std::fopen(path.c_str(), "wbx");
}

std::FILE* open_file(const std::filesystem::path& path) { return std::fopen(path.c_str(), "rb"); }

bool synchronise(std::FILE* file) {
    // What no disk stands behind cannot be synchronised.
    return ::fsync(::fileno(file)) == 0 || errno == EINVAL || errno == EROFS;
}

}  // namespace defrec
