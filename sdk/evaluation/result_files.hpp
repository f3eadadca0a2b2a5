// The tables and the page of an evaluation, as an earlier one left them.
#pragma once

#include <filesystem>

namespace defrec::cli {

// Throws CliError(kUsage) where a file of such a name is there that no evaluation left.
void check_result_files(const std::filesystem::path& out);
// Throws CliError(kOutput).
void remove_result_files(const std::filesystem::path& out);

}  // namespace defrec::cli
