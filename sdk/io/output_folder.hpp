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

// Keeps other runs out of the folder for as long as it lives: the files of two would mix. Where the
// file system knows no locks nobody is kept out.
class OutputFolderLock {
  public:
    // Throws CliError(kOutput) where another run has it.
    explicit OutputFolderLock(const std::filesystem::path& path);

  private:
    Descriptor folder_;
};

}  // namespace defrec::cli
