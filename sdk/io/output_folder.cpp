// See output_folder.hpp.
#include "sdk/io/output_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <map>
#include <string>
#include <system_error>
#include <tuple>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/base/os/stdio_file.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {
namespace {

// Device and inode of the file, with an empty name, or of its folder.
using Identity = std::tuple<dev_t, ino_t, std::string>;

Identity identity_of(const std::filesystem::path& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) == 0) return {status.st_dev, status.st_ino, ""};
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    if (::stat(folder.c_str(), &status) == 0)
        return {status.st_dev, status.st_ino, path.filename().string()};
    std::error_code error;
    return {0, 0, std::filesystem::weakly_canonical(path, error).string()};
}

}  // namespace

void create_output_folder(const std::filesystem::path& path) {
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error || !std::filesystem::is_directory(path)) {
        const std::string reason = error ? error.message() : "a file of this name is there";
        throw CliError(ExitCode::kOutput, path.string() + ": the folder cannot be created (" +
                                              reason + "); choose another with --out.");
    }
    remove_abandoned_files(path);
}

void keep_apart(const std::vector<std::filesystem::path>& inputs,
                const std::vector<std::filesystem::path>& outputs) {
    std::map<Identity, const std::filesystem::path*> written;
    for (const std::filesystem::path& output : outputs) {
        if (output.empty()) continue;
        // The folder of an output may not exist yet.
        std::error_code error;
        const auto [other, is_first] =
            written.emplace(identity_of(std::filesystem::weakly_canonical(output, error)), &output);
        if (!is_first)
            throw CliError(ExitCode::kUsage,
                           output.string() + ": " + other->second->string() +
                               " is written to this file as well; choose another for one of them.");
    }
    for (const std::filesystem::path& input : inputs) {
        std::error_code error;
        if (input.empty() || !std::filesystem::exists(input, error)) continue;
        const auto output = written.find(identity_of(input));
        if (output != written.end())
            throw CliError(ExitCode::kUsage,
                           input.string() + ": " + output->second->string() +
                               " would overwrite this input; choose another output.");
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

void OutputFolder::forget(const std::filesystem::path& file) const {
    std::error_code error;
    std::filesystem::remove(path_ / file, error);
    if (error)
        throw CliError(ExitCode::kOutput, (path_ / file).string() +
                                              ": what an earlier run left cannot "
                                              "be removed (" +
                                              error.message() + ").");
    synchronise_folder(path_);
}

}  // namespace defrec::cli
