// One receiver of frames.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "sdk/live_link/socket.hpp"

namespace defrec::cli {

using Clock = std::chrono::steady_clock;

// All messages of one frame, shared by the receivers. Numbers grow by 1 from frame to frame.
struct Packet {
    std::shared_ptr<const std::string> bytes;
    std::uint64_t number = 0;
};

// Sends packets whole and in order. Only the newest of those that come while one is being sent is
// kept; so a receiver costs at most two packets. Not thread-safe, never waits.
class Connection {
  public:
    // How long a receiver may take for one packet, and how much it may send in the meantime, which
    // is thrown away.
    static constexpr std::chrono::seconds kPacketTime{5};
    static constexpr std::size_t kMaxInput = 1 << 20;

    explicit Connection(Socket socket) : socket_(std::move(socket)) { prepare_to_send(socket_); }

    void offer(const Packet& packet, Clock::time_point now);
    // Exchange what the socket allows now. False: the receiver is gone or to be dropped,
    // end_reason() says which.
    bool send(Clock::time_point now);
    bool discard_input();
    void end_sending() { cli::end_sending(socket_); }

    bool has_unsent() const { return sending_.bytes != nullptr; }
    // When the receiver will be dropped; the far future while it has everything.
    Clock::time_point deadline() const {
        return has_unsent() ? deadline_ : Clock::time_point::max();
    }
    const Socket& socket() const { return socket_; }
    const char* end_reason() const { return end_reason_; }

    // Packets of those offered that went out whole, and those that did not and will not.
    std::uint64_t sent() const { return sent_; }
    std::uint64_t dropped() const {
        return offered_ - sent_ - (sending_.bytes ? 1 : 0) - (waiting_.bytes ? 1 : 0);
    }
    // The packets under way count as dropped from here on.
    void give_up();

  private:
    bool ends_because(const char* reason) {
        end_reason_ = reason;
        return false;
    }

    Socket socket_;
    Packet sending_, waiting_;
    std::size_t position_ = 0;  // in sending_
    std::size_t input_ = 0;     // bytes received since the last packet went out
    Clock::time_point deadline_{};
    std::uint64_t last_number_ = 0, offered_ = 0, sent_ = 0;
    const char* end_reason_ = "";
};

}  // namespace defrec::cli
