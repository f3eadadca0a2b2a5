// Files that appear whole or not at all.
#include "sdk/cli/io/atomic_file.hpp"

#include <cerrno>
#include <system_error>

#include "sdk/cli/io/exit_code.hpp"

namespace defrec::cli {

void create_output_folder(const std::filesystem::path& path) {
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error || !std::filesystem::is_directory(path)) {
        throw CliError(ExitCode::kOutput,
                       path.string() + ": the folder cannot be created" +
                           (error ? " (" + error.message() + ")"
                                  : std::string(" (a file of this name is there)")) +
                           "; choose another with --out.");
    }
}

AtomicFile::AtomicFile(const std::filesystem::path& path)
    : path_(path), temporary_(path.string() + ".partial"), file_(nullptr, &std::fclose) {
    file_.reset(std::fopen(temporary_.c_str(), "wb"));
    if (!file_) fail("cannot be created");
}

AtomicFile::~AtomicFile() {
    if (!file_) return;
    file_.reset();
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::fail(const std::string& what) const {
    const std::string reason =
        errno != 0 ? " (" + std::generic_category().message(errno) + ")" : std::string();
    throw CliError(ExitCode::kOutput,
                   path_.string() + ": the file " + what + reason +
                       "; check the folder's permissions and the space on its disk.");
}

void AtomicFile::write(std::string_view bytes) {
    errno = 0;
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
        fail("cannot be written");
}

void AtomicFile::commit() {
    errno = 0;
    if (std::fflush(file_.get()) != 0) fail("cannot be written");
    if (std::fclose(file_.release()) != 0) {
        std::error_code ignored;
        std::filesystem::remove(temporary_, ignored);
        fail("cannot be written");
    }
    std::error_code error;
    std::filesystem::rename(temporary_, path_, error);
    if (error) {
        std::error_code ignored;
        std::filesystem::remove(temporary_, ignored);
        errno = error.value();
        fail("cannot be given its name");
    }
}

void write_atomically(const std::filesystem::path& path, std::string_view bytes) {
    AtomicFile file(path);
    file.write(bytes);
    file.commit();
}

}  // namespace defrec::cli
