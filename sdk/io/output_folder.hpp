// The folder that the program writes to.
#pragma once

#include <filesystem>
#include <vector>

#include "sdk/base/os/descriptor.hpp"

namespace defrec::cli {

// Creates the folder and its parents. Throws CliError(kOutput).
void create_output_folder(const std::filesystem::path& path);

// Throws CliError(kUsage) where one of the outputs is the file of an input, which it would
// overwrite.
void keep_input(const std::filesystem::path& input,
                const std::vector<std::filesystem::path>& outputs);

// A run's folder. Other runs are kept out for as long as it lives: the files of two would mix.
// A file system without locks keeps nobody out.
class OutputFolder {
  public:
    // Creates it where absent. Throws CliError(kOutput) where that fails or another run has it.
    explicit OutputFolder(const std::filesystem::path& path);

    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(const std::filesystem::path& file) const {
        return path_ / file;
    }

  private:
    std::filesystem::path path_;
    Descriptor lock_;
};

}  // namespace defrec::cli
