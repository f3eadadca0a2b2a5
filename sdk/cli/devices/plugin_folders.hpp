// Where the library looks for plugins by itself: plugin_folders_posix.cpp,
// plugin_folders_windows.cpp.
#pragma once
#include <filesystem>
#include <vector>

namespace defrec::cli {

// Those of DEFREC_PLUGIN_PATH, then that of libdefrec.
std::vector<std::filesystem::path> plugin_folders();

}  // namespace defrec::cli
