// Ctrl-C, a request to end, and the end of the terminal.
#include <signal.h>

#include "sdk/io/interrupt.hpp"

namespace defrec::cli {
namespace {

volatile sig_atomic_t requested = 0;

void remember(int) { requested = 1; }

}  // namespace

void install_signal_handlers() {
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);
    struct sigaction action {};
    action.sa_handler = &remember;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    // If it is ignored, as by nohup, the run goes on without a terminal.
    struct sigaction before {};
    sigaction(SIGHUP, nullptr, &before);
    if (before.sa_handler == SIG_IGN) return;
    // It comes twice, from the terminal and from the shell.
    action.sa_flags = SA_RESTART;
    sigaction(SIGHUP, &action, nullptr);
}

bool interrupt_requested() { return requested != 0; }

}  // namespace defrec::cli
