// See child_process.hpp. There is no fork: cases run in a thread.
#include <io.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "conformance/worker/child_process.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec::conformance {

void MessageSender::send(const Message& message) const {
    const std::vector<unsigned char> body = encode(message);
    const uint64_t size = body.size();
    std::vector<unsigned char> bytes(sizeof size);
    std::memcpy(bytes.data(), &size, sizeof size);
    bytes.insert(bytes.end(), body.begin(), body.end());
    for (size_t sent = 0; sent < bytes.size();) {
        const int count = ::_write(descriptor_, bytes.data() + sent, unsigned(bytes.size() - sent));
        if (count <= 0) std::_Exit(1);
        sent += size_t(count);
    }
}

ChildProcess::ChildProcess(const Body& body, Isolation isolation) {
    if (isolation == Isolation::process)
        fail(DEFREC_ERROR_UNSUPPORTED, "cases run in this process here, not in one of their own");
    Pipe pipe;
    if (!pipe.open()) fail(DEFREC_ERROR_INTERNAL, "no pipe can be opened: ", std::strerror(errno));
    received_from_ = std::move(pipe.read_end);
    thread_ = std::thread([body, end = std::move(pipe.write_end)]() mutable {
        body(MessageSender(end.get()));
        end.close();
    });
}

ChildProcess::~ChildProcess() {
    if (thread_.joinable()) thread_.join();
}

// Without a time limit, which a thread could not be held to.
bool ChildProcess::fill(size_t count, std::chrono::steady_clock::time_point, Event& event) {
    while (received_.size() < count) {
        const size_t before = received_.size();
        received_.resize(std::min<size_t>(count, before + 65536));
        const int got = ::_read(received_from_.get(), received_.data() + before,
                                unsigned(received_.size() - before));
        received_.resize(before + size_t(std::max(got, 0)));
        if (got <= 0) {
            event = Event::ended;
            return false;
        }
    }
    return true;
}

std::string ChildProcess::reap(std::chrono::steady_clock::time_point) { return ""; }

}  // namespace defrec::conformance
