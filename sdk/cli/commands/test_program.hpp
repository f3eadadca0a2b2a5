// For tests: `defrec` in a process of its own, and what it may leave.
#pragma once

#include <sys/resource.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace defrec::cli {

// The program in a process of its own. output: its standard output; -1: this process's.
// file_size: bytes, to which its files may grow.
inline pid_t start_program(std::vector<std::string> arguments, int output = -1,
                           rlim_t file_size = RLIM_INFINITY) {
    arguments.insert(arguments.begin(), DEFREC_BUILD_DIR "/bin/defrec");
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
        if (output >= 0) ::dup2(output, STDOUT_FILENO);
        rlimit limit{};
        ::getrlimit(RLIMIT_FSIZE, &limit);
        limit.rlim_cur = std::min(file_size, limit.rlim_max);
        ::setrlimit(RLIMIT_FSIZE, &limit);
        ::execv(argv[0], argv.data());
        ::_exit(99);
    }
    return child;
}

inline bool has_partial_files(const std::filesystem::path& folder) {
    return std::any_of(std::filesystem::recursive_directory_iterator(folder),
                       std::filesystem::recursive_directory_iterator(), [](const auto& entry) {
                           return entry.path().filename().string().find(".partial") !=
                                  std::string::npos;
                       });
}

}  // namespace defrec::cli
