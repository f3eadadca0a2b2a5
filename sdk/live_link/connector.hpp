// Connects to a receiver that listens, and tries again and again where nobody is reached.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>

#include "sdk/live_link/connection.hpp"

namespace defrec::cli {

class Connector {
  public:
    static constexpr std::chrono::milliseconds kConnectTime{2000};
    static constexpr std::chrono::milliseconds kFirstRetry{250}, kLastRetry{4000};

    // now: the clock. Throws CliError when the host is not known.
    Connector(const Endpoint& endpoint, std::function<Clock::time_point()> now)
        : now_(std::move(now)), addresses_(endpoint) {}

    // The attempt under way; empty between two.
    const Socket& socket() const { return socket_; }
    bool is_due() const { return socket_ || now_() >= begin_at_; }
    // When the attempt under way is given up, or the next one is due.
    Clock::time_point next_time() const { return socket_ ? give_up_at_ : begin_at_; }

    void begin();
    // The attempt's outcome: the connection, or an empty socket where there is none yet.
    Socket finish();
    // The connection ended at that time: a pause follows.
    void pause(Clock::time_point now) { begin_at_ = now + retry_; }
    // Why nobody is reached, once in an outage; empty: nothing new.
    std::string take_fault() { return std::exchange(fault_, {}); }

  private:
    void fail(const std::string& reason);

    std::function<Clock::time_point()> now_;
    Addresses addresses_;
    Socket socket_;
    std::size_t attempts_ = 0;  // chooses the next of the addresses
    Clock::time_point begin_at_{}, give_up_at_{};
    std::chrono::milliseconds retry_ = kFirstRetry;
    bool is_outage_known_ = false;
    std::string fault_;
};

}  // namespace defrec::cli
