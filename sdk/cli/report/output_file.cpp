// A file that gets its name only when it is complete.
#include "sdk/cli/report/output_file.hpp"

#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace defrec::cli {

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
    temporary_ =
        path_.parent_path() /
        std::filesystem::path(path_.stem()).concat(".partial").concat(path_.extension().native());
    errno = 0;
    const std::ofstream probe(temporary_, std::ios::binary | std::ios::trunc);
    if (!probe)
        throw std::runtime_error("cannot write '" + path_.string() +
                                 "': " + std::error_code(errno, std::generic_category()).message());
}

OutputFile::~OutputFile() {
    std::error_code ignored;
    if (!temporary_.empty()) std::filesystem::remove(temporary_, ignored);
}

void OutputFile::commit() {
    std::error_code error;
    std::filesystem::rename(temporary_, path_, error);
    if (error)
        throw std::runtime_error("cannot write '" + path_.string() + "': " + error.message());
    temporary_.clear();
}

}  // namespace defrec::cli
