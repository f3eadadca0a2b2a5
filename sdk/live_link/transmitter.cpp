// Finds receivers and sends each the newest packet.
#include "sdk/live_link/transmitter.hpp"

#include <poll.h>

#include <algorithm>

namespace defrec::cli {

using std::chrono::milliseconds;

Transmitter::Transmitter(const LinkOptions& options, std::function<Clock::time_point()> now)
    : options_(options), now_(std::move(now)) {
    if (options_.kind == LinkOptions::Kind::kListen) {
        listener_ = listen_at(options_.endpoint);
        options_.endpoint = local_endpoint(listener_);
    } else {
        connector_.emplace(options_.endpoint, now_);
    }
}

void Transmitter::step(milliseconds at_most) {
    if (is_connecting() && !connector_->socket()) connect();
    wait(at_most);
    if (is_accepting()) accept_receivers();
    if (connector_ && connector_->socket()) connect();
    exchange();
}

void Transmitter::wait(milliseconds at_most) {
    const Clock::time_point now = now_();
    Clock::time_point until = now + at_most;
    std::vector<pollfd> sockets{{wake_up_.descriptor(), POLLIN, 0}};
    if (is_accepting()) {
        sockets.push_back({listener_.get(), POLLIN, 0});
    } else if (listener_) {
        until = std::min(until, accept_after_);
    }
    if (connector_ && connections_.empty()) {
        const Socket& socket = connector_->socket();
        if (socket) sockets.push_back({socket.get(), POLLOUT, 0});
        until = std::min(until, connector_->next_time());
    }
    for (const Connection& connection : connections_) {
        const int events = connection.has_unsent() ? POLLIN | POLLOUT : POLLIN;
        sockets.push_back({connection.socket().get(), static_cast<short>(events), 0});
        until = std::min(until, connection.deadline());
    }
    const auto left = std::chrono::ceil<milliseconds>(until - now);
    ::poll(sockets.data(), sockets.size(),
           static_cast<int>(std::max(left, milliseconds(0)).count()));
    if (sockets.front().revents != 0) wake_up_.clear();
}

void Transmitter::accept_receivers() {
    for (std::size_t i = 0; i < 2 * kMaxReceivers; ++i) {
        Socket socket;
        switch (accept_from(listener_, socket)) {
            case Accepted::kNobody:
                return;
            case Accepted::kNoResources:
                accept_after_ = now_() + kResourcePause;
                return;
            case Accepted::kReceiver:
                break;
        }
        if (connections_.size() < kMaxReceivers || make_room()) {
            add(std::move(socket));
        } else {
            notice("a receiver was turned away; " + std::to_string(kMaxReceivers) +
                   " are connected.");
        }
    }
}

// Ends the first connection that has not taken a whole frame yet, else the first that does not keep
// up.
bool Transmitter::make_room() {
    const auto is_idle = [](const Connection& each) { return each.sent() == 0; };
    const auto is_behind = [](const Connection& each) { return each.has_unsent(); };
    auto idle = std::find_if(connections_.begin(), connections_.end(), is_idle);
    if (idle == connections_.end())
        idle = std::find_if(connections_.begin(), connections_.end(), is_behind);
    if (idle == connections_.end()) return false;
    notice("a receiver that takes no frames was dropped, because another one came.");
    end(idle);
    return true;
}

void Transmitter::connect() {
    if (!connector_->socket()) {
        connector_->begin();
    } else if (Socket socket = connector_->finish()) {
        add(std::move(socket));
        notice("connected to " + to_string(options_.endpoint) + ".");
    }
    const std::string fault = connector_->take_fault();
    if (!fault.empty()) {
        notice("nobody is reached at " + to_string(options_.endpoint) + " (" + fault +
               "); it is tried again and again.");
    }
}

void Transmitter::exchange() {
    const Clock::time_point now = now_();
    for (auto connection = connections_.begin(); connection != connections_.end();) {
        if (connection->discard_input() && connection->send(now)) {
            ++connection;
            continue;
        }
        if (!is_ending_) notice(std::string("a receiver ") + connection->end_reason() + ".");
        connection = end(connection);
        if (connector_) connector_->pause(now);
    }
}

std::vector<Connection>::iterator Transmitter::end(std::vector<Connection>::iterator connection) {
    connection->give_up();
    ended_.sent += connection->sent();
    ended_.dropped += connection->dropped();
    return connections_.erase(connection);
}

void Transmitter::add(Socket socket) {
    connections_.emplace_back(std::move(socket));
    ++ended_.receivers;
}

void Transmitter::offer(const Packet& packet) {
    for (Connection& connection : connections_) connection.offer(packet, now_());
}

bool Transmitter::has_unsent() const {
    return std::any_of(connections_.begin(), connections_.end(),
                       [](const Connection& each) { return each.has_unsent(); });
}

void Transmitter::end_sending() {
    listener_ = Socket();
    connector_.reset();
    is_ending_ = true;
    for (Connection& connection : connections_) connection.end_sending();
}

LinkCounts Transmitter::counts() const {
    LinkCounts counts = ended_;
    for (const Connection& connection : connections_) {
        counts.sent += connection.sent();
        counts.dropped += connection.dropped();
    }
    return counts;
}

void Transmitter::notice(const std::string& text) {
    if (notice_count_++ < kMaxNotices) notices_.push_back("live link: " + text);
}

}  // namespace defrec::cli
