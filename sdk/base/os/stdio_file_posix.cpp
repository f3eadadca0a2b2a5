// See stdio_file.hpp.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "sdk/base/os/descriptor.hpp"
#include "sdk/base/os/stdio_file.hpp"

namespace defrec {

std::FILE* create_file(const std::filesystem::path& path) {
    for (;;) {
        std::FILE* file = std::fopen(path.c_str(), "wbxe");
        if (file == nullptr) return nullptr;
        while (::flock(::fileno(file), LOCK_EX) != 0 && errno == EINTR) {
        }
        // Until it was locked it looked abandoned.
        struct stat made {};
        if (::fstat(::fileno(file), &made) != 0 || made.st_nlink > 0) return file;
        std::fclose(file);
    }
}

std::error_code close_as(std::FILE* file, const std::filesystem::path& from,
                         const std::filesystem::path& to) {
    std::error_code error;
    std::filesystem::rename(from, to, error);
    if (std::fclose(file) != 0 && !error) error.assign(errno, std::generic_category());
    return error;
}

bool remove_abandoned(const std::filesystem::path& path) {
    const Descriptor file(::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    struct stat opened {
    }, named{};
    if (!file || ::fstat(file.get(), &opened) != 0 || !S_ISREG(opened.st_mode) ||
        opened.st_uid != ::geteuid() || ::flock(file.get(), LOCK_EX | LOCK_NB) != 0)
        return false;
    // Another process may have removed it, and made a new one, before it was locked here.
    return ::lstat(path.c_str(), &named) == 0 && named.st_dev == opened.st_dev &&
           named.st_ino == opened.st_ino && ::unlink(path.c_str()) == 0;
}

std::FILE* open_file(const std::filesystem::path& path) { return std::fopen(path.c_str(), "rb"); }

bool synchronise(std::FILE* file) {
    // What no disk stands behind cannot be synchronised.
    return ::fsync(::fileno(file)) == 0 || errno == EINVAL || errno == EROFS;
}

void synchronise_folder(const std::filesystem::path& folder) {
    const Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (opened) ::fsync(opened.get());
}

}  // namespace defrec
