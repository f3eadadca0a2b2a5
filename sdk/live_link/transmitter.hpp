// Finds receivers, by listening or by connecting to one, and sends each the newest packet.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "sdk/live_link/connection.hpp"
#include "sdk/live_link/connector.hpp"

namespace defrec::cli {

struct LinkOptions {
    enum class Kind { kNone, kConnect, kListen } kind = Kind::kNone;
    Endpoint endpoint;
    bool has_system_clock = false;  // in time stamps, instead of the input's
};

// Over all receivers of a run.
struct LinkCounts {
    std::uint64_t receivers = 0;  // that connected
    std::uint64_t sent = 0;  // frames, each counted for each receiver that was sent the whole of it
    std::uint64_t dropped = 0;  // frames that a connected receiver was not sent
};

// One thread at a time, but for wake().
class Transmitter {
  public:
    static constexpr std::size_t kMaxReceivers = 8;

    // now: the clock; tests bring their own. Throws CliError when the host is not known or nothing
    // can listen there.
    explicit Transmitter(const LinkOptions& options,
                         std::function<Clock::time_point()> now = &Clock::now);

    // Waits until a socket has something to do, wake() is called or `at_most` has passed, and does
    // what there is.
    void step(std::chrono::milliseconds at_most);
    // Any thread: ends the step under way, or the next.
    void wake() { wake_up_.ring(); }

    void offer(const Packet& packet);
    std::size_t receivers() const { return connections_.size(); }
    // An attempt to connect is under way or due.
    bool is_connecting() const {
        return connector_ && connections_.empty() && connector_->is_due();
    }
    bool has_unsent() const;
    // No more packets will come. Receivers that close in turn are gone after the next step; nobody
    // is let in any more.
    void end_sending();

    LinkCounts counts() const;
    // Where it listens, with the port that was chosen, or what it connects to.
    const Endpoint& endpoint() const { return options_.endpoint; }
    // What became of receivers since the last call, for people. No more than kMaxNotices in a run.
    std::vector<std::string> take_notices() { return std::exchange(notices_, {}); }

  private:
    static constexpr std::size_t kMaxNotices = 100;
    static constexpr std::chrono::seconds kResourcePause{1};

    void wait(std::chrono::milliseconds at_most);
    void accept_receivers();
    // For another receiver; false: all of them take frames.
    bool make_room();
    std::vector<Connection>::iterator end(std::vector<Connection>::iterator connection);
    void connect();
    void exchange();
    void add(Socket socket);
    void notice(const std::string& text);
    bool is_accepting() const { return listener_ && now_() >= accept_after_; }

    LinkOptions options_;
    std::function<Clock::time_point()> now_;
    WakeUp wake_up_;
    std::vector<Connection> connections_;
    LinkCounts ended_;  // what connections that are no more have counted
    std::vector<std::string> notices_;
    std::size_t notice_count_ = 0;

    Socket listener_;
    Clock::time_point accept_after_{};

    std::optional<Connector> connector_;
    bool is_ending_ = false;
};

}  // namespace defrec::cli
