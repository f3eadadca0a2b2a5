// See output_folder.hpp.
#include "sdk/io/output_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

void create_output_folder(const std::filesystem::path& path) {
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error || !std::filesystem::is_directory(path)) {
        const std::string reason = error ? error.message() : "a file of this name is there";
        throw CliError(ExitCode::kOutput, path.string() + ": the folder cannot be created (" +
                                              reason + "); choose another with --out.");
    }
}

void keep_input(const std::filesystem::path& input,
                const std::vector<std::filesystem::path>& outputs) {
    for (const std::filesystem::path& output : outputs) {
        std::error_code error;
        // The folder of an output may not exist yet.
        const std::filesystem::path resolved = std::filesystem::weakly_canonical(output, error);
        if (std::filesystem::equivalent(input, resolved, error)) {
            throw CliError(ExitCode::kUsage,
                           input.string() + ": " + output.string() +
                               " would overwrite this input; choose another output.");
        }
    }
}

OutputFolder::OutputFolder(const std::filesystem::path& path)
    : path_((create_output_folder(path), path)),
      lock_(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    if (lock_ && ::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        throw CliError(ExitCode::kOutput,
                       path.string() +
                           ": another run writes to this folder; choose another with "
                           "--out.");
}

}  // namespace defrec::cli
