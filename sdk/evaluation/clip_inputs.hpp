// What a clip's result was made of, so that results of other data are told from it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace defrec::cli {

// 16 hexadecimal digits of the names and sizes of all files in these files and folders, and of what
// is in text files: calibrations, truth, points. Where the inputs lie counts for nothing, nor do
// folders in them that begin with a dot, or `out`, which holds results.
std::string digest_of_inputs(const std::vector<std::filesystem::path>& inputs,
                             const std::filesystem::path& out);

}  // namespace defrec::cli
