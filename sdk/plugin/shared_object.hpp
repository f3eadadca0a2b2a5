// Whether a file's bytes are a complete shared object for this process: ELF
// (shared_object_posix.cpp), on Windows a DLL (shared_object_windows.cpp). The dynamic loader of
// ELF does not ask: it maps what the headers claim and dies of SIGBUS where the file is shorter.
#pragma once
#include <span>
#include <string>

namespace defrec {

// Throws Error(DEFREC_ERROR_PLUGIN) with the reason; path is for the text.
void check_shared_object(const std::string& path, std::span<const unsigned char> bytes);

}  // namespace defrec
