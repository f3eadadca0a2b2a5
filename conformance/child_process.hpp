// A forked process that sends messages: whatever it does, the process that started it goes on.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "conformance/message.hpp"

namespace defrec::conformance {

// The child's end of the pipe.
class MessageSender {
  public:
    explicit MessageSender(int descriptor) : descriptor_(descriptor) {}
    void send(const Message& message) const;  // ends the process if nobody listens any more

  private:
    int descriptor_;
};

class ChildProcess {
  public:
    // Runs body in a child, which then ends with code 0. To be called before any thread is started. Throws Error.
    explicit ChildProcess(const std::function<void(const MessageSender&)>& body);
    ~ChildProcess();  // kills the child if it still runs
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    enum class Event { message, ended, timed_out };
    // Waits for the next message, or the end of the child's messages, no longer than until the deadline.
    Event receive(Message& message, std::chrono::steady_clock::time_point deadline);

    // After the end of its messages: waits for its end, no longer than until the deadline, then kills it. Empty if it ended well,
    // else what happened: "crashed with signal 11 (Segmentation fault)", "did not end".
    std::string reap(std::chrono::steady_clock::time_point deadline);

  private:
    bool fill(size_t count, std::chrono::steady_clock::time_point deadline, Event& event);

    pid_t pid_ = -1;
    int descriptor_ = -1;
    std::vector<unsigned char> received_;
};

}  // namespace defrec::conformance
