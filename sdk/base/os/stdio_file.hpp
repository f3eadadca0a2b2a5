// What the C library's files lack: stdio_file_posix.cpp, stdio_file_windows.cpp.
#pragma once
#include <cstdio>
#include <filesystem>
#include <system_error>

namespace defrec {

// A new file to write bytes to; nullptr, with errno, where it is there already or cannot be made.
// It is locked until it is closed, where the file system can.
std::FILE* create_file(const std::filesystem::path& path);
// Closes a file that create_file made and that was flushed, and gives it another name in place of
// what has it. It stays locked until then where the system renames files that are open.
std::error_code close_as(std::FILE* file, const std::filesystem::path& from,
                         const std::filesystem::path& to);
// Removes a regular file of this user that create_file made and nobody has open any more: the
// process that wrote it has died. False where it is none.
bool remove_abandoned(const std::filesystem::path& path);
// One to read bytes from; nullptr, with errno, where there is none to be read.
std::FILE* open_file(const std::filesystem::path& path);
// Returns when the disk has the bytes that were flushed; false, with errno, on failure.
bool synchronise(std::FILE* file);
// The same of the names in a folder; nothing where the system cannot.
void synchronise_folder(const std::filesystem::path& folder);

}  // namespace defrec
