// Where libdefrec lies: library_folder_posix.cpp, library_folder_windows.cpp.
#pragma once
#include <string>

namespace defrec::cli {

// UTF-8; empty if unknown.
std::string library_folder();

}  // namespace defrec::cli
