// The folder that the program writes to.
#pragma once

#include <filesystem>

namespace defrec::cli {

// Creates the folder and its parents. Throws CliError(kOutput).
void create_output_folder(const std::filesystem::path& path);

}  // namespace defrec::cli
