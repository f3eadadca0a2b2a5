// Ctrl-C.
#include <signal.h>

#include "sdk/io/interrupt.hpp"

namespace defrec::cli {
namespace {

volatile sig_atomic_t requested = 0;

void remember(int) { requested = 1; }

}  // namespace

void install_signal_handlers() {
    struct sigaction action {};
    action.sa_handler = &remember;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);
}

bool interrupt_requested() { return requested != 0; }

}  // namespace defrec::cli
