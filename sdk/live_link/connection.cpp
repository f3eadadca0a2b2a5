// One receiver of frames.
#include "sdk/live_link/connection.hpp"

namespace defrec::cli {

void Connection::offer(const Packet& packet, Clock::time_point now) {
    // Numbers between the last packet and this one are frames that were replaced before they became
    // packets.
    offered_ += offered_ == 0 ? 1 : packet.number - last_number_;
    last_number_ = packet.number;
    if (!has_unsent()) {
        sending_ = packet;
        deadline_ = now + kPacketTime;
    } else if (position_ == 0) {
        sending_ = packet;
    } else {
        waiting_ = packet;
    }
}

bool Connection::send(Clock::time_point now) {
    while (has_unsent()) {
        std::size_t done = 0;
        switch (send_some(socket_, std::string_view(*sending_.bytes).substr(position_), done)) {
            case Transfer::kGone:
                return ends_because("is gone");
            case Transfer::kNothingNow:
                return now < deadline_ ||
                       ends_because("was dropped, because it did not take a frame within 5 s");
            case Transfer::kSome:
                break;
        }
        position_ += done;
        if (position_ < sending_.bytes->size()) continue;
        ++sent_;
        sending_ = std::exchange(waiting_, {});
        position_ = 0;
        input_ = 0;
        deadline_ = now + kPacketTime;
    }
    return true;
}

bool Connection::discard_input() {
    while (true) {
        std::size_t done = 0;
        switch (discard_some(socket_, done)) {
            case Transfer::kGone:
                return ends_because("is gone");
            case Transfer::kNothingNow:
                return true;
            case Transfer::kSome:
                break;
        }
        input_ += done;
        if (input_ > kMaxInput)
            return ends_because("was dropped, because it sent more than 1 MiB between two frames");
    }
}

void Connection::give_up() {
    sending_ = {};
    waiting_ = {};
}

}  // namespace defrec::cli
