// Ctrl-C, SIGTERM and the end of the terminal: the first ends the work early with its outputs
// finished, a second Ctrl-C or
// SIGTERM ends the program at once.
#pragma once

namespace defrec::cli {

// Also lets a closed pipe, and a file at the process's limit on file sizes, show as a failed write
// instead of killing the program. Once, from main.
void install_signal_handlers();
bool interrupt_requested();

}  // namespace defrec::cli
