// For tests: a port of the loopback that nobody listens at, and that is nobody else's for as long
// as this lives. A test may listen at it with listen_at(), also again and again.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <stdexcept>

#include "sdk/live_link/socket.hpp"

namespace defrec::cli {

inline sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
}

class TestPort {
  public:
    TestPort() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
        const int yes = 1;
        const sockaddr_in address = loopback(0);
        if (::setsockopt(socket_.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
            ::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) !=
                0) {
            throw std::runtime_error("no port is free");
        }
    }
    Endpoint endpoint() const { return local_endpoint(socket_); }

  private:
    Socket socket_;
};

}  // namespace defrec::cli
