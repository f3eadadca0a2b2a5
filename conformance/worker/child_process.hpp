// A forked process that sends messages: whatever it does, the process that started it goes on. Or a
// thread that does, for tools that cannot follow a fork and systems without: then nothing outlives
// a crash, and what hangs, hangs.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "conformance/worker/message.hpp"
#include "sdk/base/os/descriptor.hpp"

namespace defrec::conformance {

// The child's end of the pipe.
class MessageSender {
  public:
    explicit MessageSender(int descriptor) : descriptor_(descriptor) {}
    void send(const Message& message) const;  // ends the process if nobody listens any more

  private:
    int descriptor_;
};

enum class Isolation { process, none };
#ifdef _WIN32
constexpr bool kCanIsolate = false;
#else
constexpr bool kCanIsolate = true;
#endif

class ChildProcess {
  public:
    using Body = std::function<void(const MessageSender&)>;
    // Runs body in a child, which then ends with code 0. To be called before any thread is started.
    // Throws Error.
    explicit ChildProcess(const Body& body, Isolation isolation = Isolation::process);
    ~ChildProcess();  // kills the child if it still runs; waits for the thread
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    enum class Event { message, ended, timed_out };
    // Waits for the next message, or the end of the child's messages, no longer than until the
    // deadline.
    Event receive(Message& message, std::chrono::steady_clock::time_point deadline);

    // After the end of its messages: waits for its end, no longer than until the deadline, then
    // kills it. Empty if it ended well, else what happened: "crashed with signal 11 (Segmentation
    // fault)", "did not end".
    std::string reap(std::chrono::steady_clock::time_point deadline);

  private:
    void start_process(const Body& body, Descriptor write_end);
    bool fill(size_t count, std::chrono::steady_clock::time_point deadline, Event& event);

    pid_t pid_ = -1;  // none: it is a thread
    std::thread thread_;
    Descriptor received_from_;
    std::vector<unsigned char> received_;
};

}  // namespace defrec::conformance
