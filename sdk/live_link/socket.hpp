// The operating system's TCP sockets, none of which ever blocks.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/base/os/descriptor.hpp"
#include "sdk/live_link/endpoint.hpp"

struct addrinfo;

namespace defrec::cli {

using Socket = Descriptor;

// The addresses of a host, looked up once.
class Addresses {
  public:
    // Throws CliError(kUsage) for a host that is not known.
    explicit Addresses(const Endpoint& endpoint);
    ~Addresses();
    Addresses(const Addresses&) = delete;
    Addresses& operator=(const Addresses&) = delete;

    std::size_t count() const { return items_.size(); }
    const addrinfo& operator[](std::size_t index) const { return *items_[index]; }

  private:
    addrinfo* list_ = nullptr;
    std::vector<const addrinfo*> items_;
};

// Throws CliError(kOutput) where nothing can listen there. what: listens, for the message.
Socket listen_at(const Endpoint& endpoint, const std::string& what = "live link");
// Where it listens, with the port that was chosen for port 0.
Endpoint local_endpoint(const Socket& listener);

enum class Accepted { kReceiver, kNobody, kNoResources };
Accepted accept_from(const Socket& listener, Socket& receiver);

// Begins to connect; an empty socket when that failed at once. The socket turns writable when it is
// decided: connection_error.
Socket begin_to_connect(const addrinfo& address);
// The error of a socket that turned writable: empty when connected, else what went wrong.
std::string connection_error(const Socket& socket);

// Makes an accepted or connected socket fit for frames: without delay, and with a short queue in
// the system, so that what a slow receiver gets is not old.
void prepare_to_send(const Socket& socket);
// Small pieces go out without delay.
void send_at_once(const Socket& socket);

enum class Transfer { kSome, kNothingNow, kGone };
// `done`: how many bytes were taken. Never raises SIGPIPE.
Transfer send_some(const Socket& socket, std::string_view bytes, std::size_t& done);
// `done`: how many bytes have come. kGone also at the end of the stream.
Transfer receive_some(const Socket& socket, char* bytes, std::size_t size, std::size_t& done);
// Throws away what has come. `done`: how many bytes.
Transfer discard_some(const Socket& socket, std::size_t& done);
// The other side sees the end of the stream once it has read everything; receiving goes on.
void end_sending(const Socket& socket);

// Ends another thread's poll on descriptor().
class WakeUp {
  public:
    WakeUp();
    int descriptor() const { return socket_.get(); }
    void ring();
    void clear();

  private:
    Socket socket_;
};

}  // namespace defrec::cli
