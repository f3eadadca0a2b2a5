// A program that is started, listened to and ended in time: child_program_posix.cpp,
// child_program_windows.cpp.
#pragma once
#include <chrono>
#include <string>
#include <vector>

namespace defrec::cli {

struct ChildOutput {
    std::string text;  // of its standard output, 1 MiB at most
    bool timed_out = false;
    std::string crash;  // what ended it; empty: it ended by itself, with exit_code
    int exit_code = 0;
};

// arguments: of these the first is the program. It reads nothing, and its errors are not shown.
// Throws CliError(ExitCode::kInternal) where it cannot be started.
ChildOutput run_child(const std::vector<std::string>& arguments, std::chrono::milliseconds limit);

}  // namespace defrec::cli
