// See child_process.hpp.
#include "conformance/worker/child_process.hpp"

#include <cstring>

namespace defrec::conformance {

ChildProcess::Event ChildProcess::receive(Message& message,
                                          std::chrono::steady_clock::time_point deadline) {
    Event event = Event::ended;
    uint64_t size = 0;
    received_.clear();
    if (!fill(sizeof size, deadline, event)) return event;
    std::memcpy(&size, received_.data(), sizeof size);
    received_.clear();
    if (!fill(size, deadline, event)) return event;
    message = decode(received_);
    return Event::message;
}

}  // namespace defrec::conformance
