// See stdio_file.hpp.
#include <fcntl.h>
#include <io.h>
#include <sys/stat.h>

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

std::FILE* open_file(const std::filesystem::path& path) { return ::_wfopen(path.c_str(), L"rbN"); }

bool synchronise(std::FILE* file) { return ::_commit(::_fileno(file)) == 0; }

}  // namespace defrec
