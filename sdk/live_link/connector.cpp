// Connects to a receiver that listens.
#include "sdk/live_link/connector.hpp"

#include <poll.h>

#include <algorithm>

namespace defrec::cli {

void Connector::begin() {
    socket_ = begin_to_connect(addresses_[attempts_++ % addresses_.count()]);
    give_up_at_ = now_() + kConnectTime;
    if (!socket_) fail("no connection");
}

Socket Connector::finish() {
    pollfd socket{socket_.get(), POLLOUT, 0};
    if (::poll(&socket, 1, 0) <= 0) {
        if (now_() >= give_up_at_) fail("no answer");
        return {};
    }
    const std::string error = connection_error(socket_);
    if (!error.empty()) {
        fail(error);
        return {};
    }
    retry_ = kFirstRetry;
    is_outage_known_ = false;
    return std::exchange(socket_, Socket());
}

void Connector::fail(const std::string& reason) {
    socket_ = Socket();
    // The other addresses of the host come first.
    if (attempts_ % addresses_.count() != 0) {
        begin_at_ = now_();
        return;
    }
    begin_at_ = now_() + retry_;
    retry_ = std::min(2 * retry_, kLastRetry);
    if (!std::exchange(is_outage_known_, true)) fault_ = reason;
}

}  // namespace defrec::cli
