// See stdio_file.hpp.
#include <fcntl.h>
#include <io.h>
#include <sys/stat.h>

#include <cerrno>
#include <system_error>

#include "sdk/base/os/stdio_file.hpp"

namespace defrec {

std::FILE* create_file(const std::filesystem::path& path) {
    const int descriptor =
        ::_wopen(path.c_str(), _O_CREAT | _O_EXCL | _O_WRONLY | _O_BINARY | _O_NOINHERIT,
                 _S_IREAD | _S_IWRITE);
    if (descriptor < 0) return nullptr;
    std::FILE* file = ::_fdopen(descriptor, "wb");
    if (file == nullptr) ::_close(descriptor);
    return file;
}

std::error_code close_as(std::FILE* file, const std::filesystem::path& from,
                         const std::filesystem::path& to) {
    std::error_code error;
    if (std::fclose(file) != 0)
        error.assign(errno, std::generic_category());
    else
        std::filesystem::rename(from, to, error);
    return error;
}

// The system removes no file that is open.
bool remove_abandoned(const std::filesystem::path& path) {
    std::error_code error;
    return std::filesystem::is_regular_file(std::filesystem::symlink_status(path, error)) &&
           std::filesystem::remove(path, error);
}

std::FILE* open_file(const std::filesystem::path& path) { return ::_wfopen(path.c_str(), L"rbN"); }

bool synchronise(std::FILE* file) { return ::_commit(::_fileno(file)) == 0; }

void synchronise_folder(const std::filesystem::path&) {}

}  // namespace defrec
