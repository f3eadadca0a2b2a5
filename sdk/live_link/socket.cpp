// TCP sockets on POSIX systems.
#include "sdk/live_link/socket.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <system_error>

#include "sdk/io/exit_code.hpp"

namespace defrec::cli {
namespace {

constexpr int kBacklog = 16;
constexpr int kSendBufferBytes = 128 * 1024;

std::string describe(int error) { return std::generic_category().message(error); }

void set_option(const Socket& socket, int level, int name, int value) {
    ::setsockopt(socket.get(), level, name, &value, sizeof value);
}

Socket open_socket(const addrinfo& address) {
    return Socket(::socket(address.ai_family, address.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC,
                           address.ai_protocol));
}

// TCP allows it: on the same computer, when the port that the system chose for this end is the one
// that nobody listens at. Such a connection would keep the receiver from ever listening there.
bool is_connected_to_itself(const Socket& socket) {
    sockaddr_storage here{}, there{};
    socklen_t here_size = sizeof here, there_size = sizeof there;
    return ::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&here), &here_size) == 0 &&
           ::getpeername(socket.get(), reinterpret_cast<sockaddr*>(&there), &there_size) == 0 &&
           here_size == there_size && std::memcmp(&here, &there, here_size) == 0;
}

bool is_for_later(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace

Addresses::Addresses(const Endpoint& endpoint) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = AI_NUMERICSERV;
    const int error =
        ::getaddrinfo(endpoint.host.c_str(), std::to_string(endpoint.port).c_str(), &hints, &list_);
    if (error != 0) {
        throw CliError(ExitCode::kUsage, "the host '" + endpoint.host +
                                             "' of the live link is not known (" +
                                             ::gai_strerror(error) + ").");
    }
    for (const addrinfo* item = list_; item != nullptr; item = item->ai_next)
        items_.push_back(item);
}

Addresses::~Addresses() {
    if (list_ != nullptr) ::freeaddrinfo(list_);
}

Socket listen_at(const Endpoint& endpoint, const std::string& what) {
    const Addresses addresses(endpoint);
    Socket socket = open_socket(addresses[0]);
    // The port is free at once after a run, though its connections linger.
    if (socket) set_option(socket, SOL_SOCKET, SO_REUSEADDR, 1);
    if (!socket || ::bind(socket.get(), addresses[0].ai_addr, addresses[0].ai_addrlen) != 0 ||
        ::listen(socket.get(), kBacklog) != 0) {
        const std::string reason = describe(errno);
        throw CliError(ExitCode::kOutput, "the " + what + " cannot listen at " +
                                              to_string(endpoint) + " (" + reason + ").");
    }
    return socket;
}

Endpoint local_endpoint(const Socket& listener) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    std::array<char, NI_MAXHOST> host{};
    std::array<char, NI_MAXSERV> port{};
    if (::getsockname(listener.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
        ::getnameinfo(reinterpret_cast<const sockaddr*>(&address), size, host.data(), host.size(),
                      port.data(), port.size(), NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
        throw CliError(ExitCode::kInternal, "the live link's own address is not known.");
    }
    return {host.data(), static_cast<std::uint16_t>(std::stoi(port.data()))};
}

Accepted accept_from(const Socket& listener, Socket& receiver) {
    receiver = Socket(::accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (receiver) return Accepted::kReceiver;
    const bool has_no_resources =
        errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
    return has_no_resources ? Accepted::kNoResources : Accepted::kNobody;
}

Socket begin_to_connect(const addrinfo& address) {
    Socket socket = open_socket(address);
    if (!socket) return {};
    if (::connect(socket.get(), address.ai_addr, address.ai_addrlen) != 0 && errno != EINPROGRESS)
        return {};
    return socket;
}

std::string connection_error(const Socket& socket) {
    int error = 0;
    socklen_t size = sizeof error;
    if (::getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &size) != 0) error = errno;
    if (error != 0) return describe(error);
    return is_connected_to_itself(socket) ? describe(ECONNREFUSED) : "";
}

void send_at_once(const Socket& socket) { set_option(socket, IPPROTO_TCP, TCP_NODELAY, 1); }

void prepare_to_send(const Socket& socket) {
    send_at_once(socket);
    set_option(socket, SOL_SOCKET, SO_SNDBUF, kSendBufferBytes);
}

Transfer send_some(const Socket& socket, std::string_view bytes, std::size_t& done) {
    const ssize_t count =
        ::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0) return is_for_later(errno) ? Transfer::kNothingNow : Transfer::kGone;
    done = static_cast<std::size_t>(count);
    return Transfer::kSome;
}

Transfer receive_some(const Socket& socket, char* bytes, std::size_t size, std::size_t& done) {
    const ssize_t count = ::recv(socket.get(), bytes, size, MSG_DONTWAIT);
    if (count < 0) return is_for_later(errno) ? Transfer::kNothingNow : Transfer::kGone;
    if (count == 0) return Transfer::kGone;
    done = static_cast<std::size_t>(count);
    return Transfer::kSome;
}

Transfer discard_some(const Socket& socket, std::size_t& done) {
    std::array<char, 4096> scratch;
    return receive_some(socket, scratch.data(), scratch.size(), done);
}

void end_sending(const Socket& socket) { ::shutdown(socket.get(), SHUT_WR); }

WakeUp::WakeUp() : socket_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (!socket_)
        throw CliError(ExitCode::kInternal,
                       "the live link's thread cannot be woken (" + describe(errno) + ").");
}

void WakeUp::ring() {
    const std::uint64_t one = 1;
    // It fails only while the count is at its end, and then the thread is woken already.
    static_cast<void>(!::write(descriptor(), &one, sizeof one));
}

void WakeUp::clear() {
    std::uint64_t count = 0;
    static_cast<void>(!::read(descriptor(), &count, sizeof count));
}

}  // namespace defrec::cli
