// See child_process.hpp.
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "conformance/worker/child_process.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec::conformance {
namespace {

using Clock = std::chrono::steady_clock;

int milliseconds_until(Clock::time_point deadline) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    return int(std::clamp<int64_t>(left + 1, 0, 1 << 30));
}

}  // namespace

void MessageSender::send(const Message& message) const {
    const std::vector<unsigned char> body = encode(message);
    const uint64_t size = body.size();
    std::vector<unsigned char> bytes(sizeof size);
    std::memcpy(bytes.data(), &size, sizeof size);
    bytes.insert(bytes.end(), body.begin(), body.end());
    for (size_t sent = 0; sent < bytes.size();) {
        const ssize_t count = ::write(descriptor_, bytes.data() + sent, bytes.size() - sent);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) _exit(1);
        sent += size_t(count);
    }
}

ChildProcess::ChildProcess(const Body& body, Isolation isolation) {
    Pipe pipe;
    if (!pipe.open()) fail(DEFREC_ERROR_INTERNAL, "no pipe can be opened: ", std::strerror(errno));
    received_from_ = std::move(pipe.read_end);
    if (isolation == Isolation::process)
        start_process(body, std::move(pipe.write_end));
    else
        thread_ = std::thread(
            [body, end = std::move(pipe.write_end)] { body(MessageSender(end.get())); });
}

void ChildProcess::start_process(const Body& body, Descriptor write_end) {
    std::fflush(nullptr);  // or the child would print it once more
    pid_ = ::fork();
    if (pid_ < 0) fail(DEFREC_ERROR_INTERNAL, "no process can be started: ", std::strerror(errno));
    if (pid_ == 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        ::signal(SIGPIPE, SIG_IGN);
        received_from_.close();
        body(MessageSender(write_end.get()));
        std::exit(0);
    }
}

ChildProcess::~ChildProcess() {
    if (thread_.joinable()) thread_.join();
    if (pid_ > 0) {
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
    }
}

// Reads until received_ has count bytes; false with the event otherwise.
bool ChildProcess::fill(size_t count, Clock::time_point deadline, Event& event) {
    while (received_.size() < count) {
        pollfd waiting{received_from_.get(), POLLIN, 0};
        const int ready = ::poll(&waiting, 1, milliseconds_until(deadline));
        if (ready < 0 && errno == EINTR) continue;
        if (ready <= 0) {
            event = Event::timed_out;
            return false;
        }
        const size_t before = received_.size();
        received_.resize(std::min(count, before + 65536));
        const ssize_t got =
            ::read(received_from_.get(), received_.data() + before, received_.size() - before);
        received_.resize(before + size_t(std::max<ssize_t>(got, 0)));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) {
            event = Event::ended;
            return false;
        }
    }
    return true;
}

std::string ChildProcess::reap(Clock::time_point deadline) {
    if (pid_ < 0) return "";
    int status = 0;
    while (::waitpid(pid_, &status, WNOHANG) == 0) {
        if (Clock::now() >= deadline) {
            ::kill(pid_, SIGKILL);
            ::waitpid(pid_, &status, 0);
            pid_ = -1;
            return "did not end";
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    pid_ = -1;
    if (WIFSIGNALED(status))
        return concat("crashed with signal ", WTERMSIG(status), " (", ::strsignal(WTERMSIG(status)),
                      ")");
    if (WEXITSTATUS(status) != 0)
        return concat("ended the process with code ", WEXITSTATUS(status));
    return "";
}

}  // namespace defrec::conformance
