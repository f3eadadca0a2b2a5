// See system.hpp.
#include <dlfcn.h>
#include <signal.h>
#include <sys/utsname.h>

#include <filesystem>
#include <iterator>

#include "conformance/worker/system.hpp"
#include "conformance/worker/text_file.hpp"
#include "include/defrec_c.h"
#include "sdk/base/os/platform.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec::conformance {

size_t thread_count() {
    const std::filesystem::directory_iterator tasks("/proc/self/task");
    return size_t(std::distance(begin(tasks), end(tasks)));
}

std::string system_text() {
    utsname names{};
    uname(&names);
    const std::string distribution = value_in("/etc/os-release", "PRETTY_NAME");
    return concat(names.sysname, " ", names.release, " ", names.machine,
                  distribution.empty() ? "" : ", ", distribution);
}

std::string library_folder() {
    Dl_info info;
    if (dladdr(reinterpret_cast<const void*>(&defrec_version), &info) == 0 ||
        info.dli_fname == nullptr)
        fail(DEFREC_ERROR_INTERNAL, "the folder of libdefrec is unknown");
    const std::string library = platform::canonical_path(info.dli_fname);
    return library.substr(0, library.find_last_of('/') + 1);
}

struct SignalState::State {
    static constexpr int kSignals = 32;
    sigset_t mask;
    void (*handlers[kSignals])(int) = {};
};

SignalState::SignalState() : state_(std::make_unique<State>()) {
    pthread_sigmask(SIG_SETMASK, nullptr, &state_->mask);
    for (int i = 1; i < State::kSignals; ++i) {
        struct sigaction action {};
        sigaction(i, nullptr, &action);
        state_->handlers[i] = action.sa_handler;
    }
}
SignalState::~SignalState() = default;

std::string SignalState::difference(const SignalState& later) const {
    for (int i = 1; i < State::kSignals; ++i) {
        if (sigismember(&state_->mask, i) != sigismember(&later.state_->mask, i))
            return concat("its caller's signal mask, signal ", i);
        if (state_->handlers[i] != later.state_->handlers[i])
            return concat("the handler of signal ", i);
    }
    return "";
}

}  // namespace defrec::conformance
