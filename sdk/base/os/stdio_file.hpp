// What the C library's files lack: stdio_file_posix.cpp, stdio_file_windows.cpp.
#pragma once
#include <cstdio>
#include <filesystem>

namespace defrec {

// A new file to write bytes to; nullptr, with errno, where it is there already or cannot be made.
std::FILE* create_file(const std::filesystem::path& path);
// One to read bytes from; nullptr, with errno, where there is none to be read.
std::FILE* open_file(const std::filesystem::path& path);
// Returns when the disk has the bytes that were flushed; false, with errno, on failure.
bool synchronise(std::FILE* file);

}  // namespace defrec
