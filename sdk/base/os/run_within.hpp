// Calls that may never return, made so that their caller always does.
#pragma once
#include <chrono>
#include <functional>

namespace defrec {

// Runs body on a thread of its own and waits until it has ended, and what it owns is gone; throws
// what it threw. false: that took longer than limit. The thread then goes on alone, so body must
// own all that it uses. Throws Error(DEFREC_ERROR_OUT_OF_MEMORY) where there can be no thread; body
// has not run then.
bool run_within(std::chrono::milliseconds limit, std::function<void()> body);

// In a catch (...) round foreign code, on a thread that somebody waits for with a limit: does not
// return where that code ends the thread itself (pthread_exit, pthread_cancel), which a handler
// cannot stop without ending the process. The thread then stays, as one that gets no answer.
void stay_if_thread_ends() noexcept;

}  // namespace defrec
