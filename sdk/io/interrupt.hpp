// Ctrl-C, SIGTERM and the end of the terminal: the first ends the work early with its outputs
// finished, a second Ctrl-C or SIGTERM ends the program at once.
#pragma once
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

// Also lets a closed pipe, and a file at the process's limit on file sizes, show as a failed write
// instead of killing the program. Once, from main.
void install_signal_handlers();
bool interrupt_requested();
// CliError(kInterrupted), where there is nothing to finish.
inline void throw_if_interrupted() {
    if (interrupt_requested()) throw CliError(ExitCode::kInterrupted, "interrupted.");
}

}  // namespace defrec::cli
