// Ctrl-C, Ctrl-Break and the end of the console.

#include <atomic>

#include "sdk/base/os/windows_api.hpp"
#include "sdk/io/interrupt.hpp"

namespace defrec::cli {
namespace {

std::atomic<bool> requested{false};

// The second time it ends the program.
BOOL WINAPI remember(DWORD) { return requested.exchange(true) ? FALSE : TRUE; }

}  // namespace

void install_signal_handlers() { ::SetConsoleCtrlHandler(&remember, TRUE); }

bool interrupt_requested() { return requested; }

}  // namespace defrec::cli
