// Receivers that come and go: real sockets on the loopback, and a clock that the test sets.
#include "sdk/live_link/transmitter.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>

#include <memory>

#include "sdk/io/exit_code.hpp"
#include "sdk/live_link/connector.hpp"
#include "sdk/live_link/test_port.hpp"

using namespace defrec::cli;
using namespace std::chrono_literals;

namespace {

const LinkOptions kListen{LinkOptions::Kind::kListen, {"127.0.0.1", 0}};

Packet packet(std::uint64_t number) {
    return {std::make_shared<const std::string>(100, static_cast<char>('a' + number)), number};
}

// A receiver that connects to the transmitter.
Socket connect_to(const Transmitter& transmitter) {
    Socket socket(::socket(AF_INET, SOCK_STREAM, 0));
    const sockaddr_in address = loopback(transmitter.endpoint().port);
    REQUIRE(::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) ==
            0);
    return socket;
}

std::string read(const Socket& socket, std::size_t size) {
    std::string text(size, 0);
    const ssize_t count = ::recv(socket.get(), text.data(), size, MSG_WAITALL);
    text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return text;
}

// Lets the transmitter work until `is_done`; gives up after very many steps.
template <typename Condition>
bool step_until(Transmitter& transmitter, const Condition& is_done) {
    for (int i = 0; i < 1000; ++i) {
        if (is_done()) return true;
        transmitter.step(10ms);
    }
    return false;
}

bool step_until_receivers(Transmitter& transmitter, std::size_t count) {
    return step_until(transmitter, [&] { return transmitter.receivers() == count; });
}

void send(Transmitter& transmitter, std::uint64_t number) {
    transmitter.offer(packet(number));
    REQUIRE(step_until(transmitter, [&] { return !transmitter.has_unsent(); }));
}

// A server that receives.
struct Server {
    explicit Server(const Endpoint& endpoint) : socket(listen_at(endpoint)) {}
    Socket accept() const { return Socket(::accept(blocking(), nullptr, nullptr)); }
    int blocking() const {
        ::fcntl(socket.get(), F_SETFL, 0);
        return socket.get();
    }
    Socket socket;
};

}  // namespace

TEST_CASE("every receiver gets what comes after it has connected") {
    Transmitter transmitter(kListen);
    CHECK(transmitter.endpoint().port != 0);
    send(transmitter, 1);
    const Socket first = connect_to(transmitter);
    REQUIRE(step_until_receivers(transmitter, 1));
    send(transmitter, 2);
    const Socket late = connect_to(transmitter);
    REQUIRE(step_until_receivers(transmitter, 2));
    send(transmitter, 3);
    CHECK(read(first, 200) == *packet(2).bytes + *packet(3).bytes);
    CHECK(read(late, 100) == *packet(3).bytes);
    CHECK(transmitter.counts().receivers == 2);
    CHECK(transmitter.counts().sent == 3);
    CHECK(transmitter.counts().dropped == 0);
}

TEST_CASE("row 74: a receiver that vanishes or sends garbage does no harm to the others") {
    Transmitter transmitter(kListen);
    const Socket good = connect_to(transmitter);
    Socket vanishing = connect_to(transmitter);
    const Socket flooding = connect_to(transmitter);
    REQUIRE(step_until_receivers(transmitter, 3));
    vanishing = Socket();
    REQUIRE(step_until_receivers(transmitter, 2));
    const std::string garbage(1 << 16, '?');
    REQUIRE(step_until(transmitter, [&] {
        static_cast<void>(
            ::send(flooding.get(), garbage.data(), garbage.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
        return transmitter.receivers() == 1;
    }));
    send(transmitter, 1);
    CHECK(read(good, 100) == *packet(1).bytes);
    CHECK(transmitter.take_notices() ==
          std::vector<std::string>{"live link: a receiver is gone.",
                                   "live link: a receiver was dropped, because it sent more than 1 "
                                   "MiB between two frames."});
}

TEST_CASE("no more receivers than stated") {
    Transmitter transmitter(kListen);
    std::vector<Socket> receivers;
    for (std::size_t i = 0; i < Transmitter::kMaxReceivers; ++i)
        receivers.push_back(connect_to(transmitter));
    REQUIRE(step_until_receivers(transmitter, Transmitter::kMaxReceivers));
    send(transmitter, 1);
    const Socket turned_away = connect_to(transmitter);
    REQUIRE(step_until(transmitter, [&] { return !transmitter.take_notices().empty(); }));
    CHECK(read(turned_away, 1).empty());
    CHECK(transmitter.receivers() == Transmitter::kMaxReceivers);
    receivers.pop_back();
    REQUIRE(step_until_receivers(transmitter, Transmitter::kMaxReceivers - 1));
    const Socket next = connect_to(transmitter);
    CHECK(step_until_receivers(transmitter, Transmitter::kMaxReceivers));
}

TEST_CASE("row 102: receivers that take no frame make room for one that comes") {
    Transmitter transmitter(kListen);
    std::vector<Socket> idle;
    for (std::size_t i = 0; i < Transmitter::kMaxReceivers; ++i)
        idle.push_back(connect_to(transmitter));
    REQUIRE(step_until_receivers(transmitter, Transmitter::kMaxReceivers));
    const Socket next = connect_to(transmitter);
    REQUIRE(step_until(transmitter, [&] { return !transmitter.take_notices().empty(); }));
    CHECK(transmitter.receivers() == Transmitter::kMaxReceivers);
    CHECK(read(idle.front(), 1).empty());  // the first that came went
    send(transmitter, 1);
    CHECK(read(next, 100).size() == 100);
}

TEST_CASE("a server that went away is found again when it is back") {
    const TestPort port;
    const Endpoint endpoint = port.endpoint();
    auto server = std::make_unique<Server>(endpoint);
    Clock::time_point now{};
    Transmitter transmitter({LinkOptions::Kind::kConnect, endpoint}, [&] { return now; });
    CHECK(transmitter.is_connecting());
    REQUIRE(step_until_receivers(transmitter, 1));
    CHECK_FALSE(transmitter.is_connecting());
    {
        const Socket receiver = server->accept();
        send(transmitter, 1);
        CHECK(read(receiver, 100) == *packet(1).bytes);
        server.reset();
    }
    REQUIRE(step_until_receivers(transmitter, 0));
    CHECK_FALSE(transmitter.is_connecting());

    // Nobody listens: the pauses between attempts grow up to a limit.
    std::vector<std::chrono::milliseconds> pauses{Connector::kFirstRetry};
    for (int i = 0; i < 6; ++i) {
        now += pauses.back() - 1ms;
        transmitter.step(0ms);
        CHECK_FALSE(transmitter.is_connecting());
        now += 1ms;
        CHECK(transmitter.is_connecting());
        REQUIRE(step_until(transmitter, [&] { return !transmitter.is_connecting(); }));
        CHECK(transmitter.receivers() == 0);
        pauses.push_back(i == 0 ? Connector::kFirstRetry
                                : std::min(2 * pauses.back(), Connector::kLastRetry));
    }
    CHECK(pauses.back() == Connector::kLastRetry);

    auto again = std::make_unique<Server>(endpoint);
    now += Connector::kLastRetry;
    REQUIRE(step_until_receivers(transmitter, 1));
    Socket receiver = again->accept();
    send(transmitter, 2);
    CHECK(read(receiver, 100) == *packet(2).bytes);
    const std::string name = to_string(endpoint);
    CHECK(transmitter.take_notices() ==
          std::vector<std::string>{"live link: connected to " + name + ".",
                                   "live link: a receiver is gone.",
                                   "live link: nobody is reached at " + name +
                                       " (Connection refused); it is tried again and again.",
                                   "live link: connected to " + name + "."});
    CHECK(transmitter.counts().receivers == 2);

    // The next outage is one of its own: it is said, and the pauses begin anew.
    receiver = Socket();
    again.reset();
    REQUIRE(step_until_receivers(transmitter, 0));
    now += Connector::kFirstRetry;
    CHECK(transmitter.is_connecting());
    REQUIRE(step_until(transmitter, [&] { return !transmitter.is_connecting(); }));
    CHECK(transmitter.take_notices().back().find("nobody is reached") != std::string::npos);
}

TEST_CASE("a connection to itself is none") {
    const Socket socket(::socket(AF_INET, SOCK_STREAM, 0));
    sockaddr_in address = loopback(0);
    REQUIRE(::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    address = loopback(local_endpoint(socket).port);
    REQUIRE(::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) ==
            0);
    CHECK(connection_error(socket) == "Connection refused");
    const Server server({"127.0.0.1", 0});
    const Socket other(::socket(AF_INET, SOCK_STREAM, 0));
    address = loopback(local_endpoint(server.socket).port);
    REQUIRE(::connect(other.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) ==
            0);
    CHECK(connection_error(other).empty());
}

TEST_CASE("what cannot be opened is said at once") {
    const Server server({"127.0.0.1", 0});
    CHECK_THROWS_AS(Transmitter({LinkOptions::Kind::kListen, local_endpoint(server.socket)}),
                    CliError);
    CHECK_THROWS_AS(Transmitter({LinkOptions::Kind::kConnect, {"not a host", 1}}), CliError);
}

TEST_CASE("after the end receivers have everything, see the end, and nobody is let in") {
    Transmitter transmitter(kListen);
    const Socket receiver = connect_to(transmitter);
    // Input that nobody has read would let the system throw away what is under way.
    REQUIRE(::send(receiver.get(), "?", 1, 0) == 1);
    REQUIRE(step_until_receivers(transmitter, 1));
    send(transmitter, 1);
    transmitter.end_sending();
    CHECK(read(receiver, 200) == *packet(1).bytes);
    ::shutdown(receiver.get(), SHUT_RDWR);
    CHECK(step_until_receivers(transmitter, 0));
    CHECK(transmitter.take_notices().empty());
    const Socket late(::socket(AF_INET, SOCK_STREAM, 0));
    const sockaddr_in address = loopback(transmitter.endpoint().port);
    CHECK(::connect(late.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0);
}
