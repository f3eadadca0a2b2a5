// The folder that the program writes to.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sdk/base/os/descriptor.hpp"
#include "sdk/base/os/random_token.hpp"

namespace defrec::cli {

// Creates the folder and its parents, and removes what runs that died have left half written there.
// Throws CliError(kOutput).
void create_output_folder(const std::filesystem::path& path);

// Throws CliError(kUsage) where an output is the file of an input or of another output, which it
// would overwrite: by device and inode, so that links and other ways of writing a name do not hide
// it. Files that do not exist are their folder and name; an input that does not is none, and an
// empty path neither.
void keep_apart(const std::vector<std::filesystem::path>& inputs,
                const std::vector<std::filesystem::path>& outputs);

// A run's folder. Other runs are kept out for as long as it lives: the files of two would mix.
// A file system without locks keeps nobody out.
class OutputFolder {
  public:
    // Creates it where absent. Throws CliError(kOutput) where that fails or another run has it.
    explicit OutputFolder(const std::filesystem::path& path);

    // Removes the file that says that an earlier run was finished. Returns when the disk knows.
    // Throws CliError(kOutput).
    void forget(const std::filesystem::path& file) const;

    // The run's name, as no other has it.
    const std::string& run() const { return run_; }
    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(const std::filesystem::path& file) const {
        return path_ / file;
    }

  private:
    std::filesystem::path path_;
    const std::string run_ = random_token();
    Descriptor lock_;
};

}  // namespace defrec::cli
