// What a receiver is sent whatever it does: sockets whose other end the test holds, and a clock
// that the test sets.
#include "sdk/live_link/connection.hpp"

#include <doctest/doctest.h>
#include <sys/socket.h>

#include <algorithm>
#include <csignal>
#include <optional>
#include <string>
#include <vector>

using namespace defrec::cli;
using namespace std::chrono_literals;

namespace {

constexpr std::size_t kLarge = 8 << 20;  // more than a socket takes at once
const Clock::time_point kStart{};

Packet packet(std::uint64_t number, std::size_t size) {
    return {std::make_shared<const std::string>(size, static_cast<char>('a' + number)), number};
}

struct Pair {
    Pair() {
        int ends[2] = {-1, -1};
        REQUIRE(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends) == 0);
        connection.emplace(Socket(ends[0]));
        receiver = Socket(ends[1]);
    }

    // Everything that the receiver can read now.
    std::string read() const {
        std::string all;
        std::vector<char> part(1 << 16);
        for (ssize_t count = 0;
             (count = ::recv(receiver.get(), part.data(), part.size(), 0)) > 0;) {
            all.append(part.data(), static_cast<std::size_t>(count));
        }
        return all;
    }

    // Everything that the connection has for the receiver.
    std::string read_to_the_end() {
        std::string all;
        while (connection->has_unsent()) {
            REQUIRE(connection->send(kStart));
            all += read();
        }
        return all;
    }

    void write(std::size_t size) {
        const std::string garbage(size, '?');
        std::size_t done = 0;
        while (done < size) {
            const ssize_t count = ::send(receiver.get(), garbage.data() + done, size - done, 0);
            if (count <= 0) break;
            done += static_cast<std::size_t>(count);
            REQUIRE(connection->discard_input());
        }
    }

    std::optional<Connection> connection;
    Socket receiver;
};

std::string text_of(const Packet& packet) { return *packet.bytes; }

}  // namespace

TEST_CASE(
    "row 74: of the packets that come while one is being sent, the newest follows, and nothing of "
    "the others") {
    Pair pair;
    pair.connection->offer(packet(1, kLarge), kStart);
    REQUIRE(pair.connection->send(kStart));
    REQUIRE(pair.connection->has_unsent());
    for (std::uint64_t number = 2; number <= 5; ++number)
        pair.connection->offer(packet(number, 1000), kStart);
    CHECK(pair.read_to_the_end() == text_of(packet(1, kLarge)) + text_of(packet(5, 1000)));
    CHECK(pair.connection->sent() == 2);
    CHECK(pair.connection->dropped() == 3);
}

TEST_CASE("a packet of which nothing was sent yet gives way to a newer one") {
    Pair pair;
    pair.connection->offer(packet(1, 1000), kStart);
    pair.connection->offer(packet(2, 1000), kStart);
    CHECK(pair.read_to_the_end() == text_of(packet(2, 1000)));
    CHECK(pair.connection->dropped() == 1);
}

TEST_CASE("frames that never became packets count as dropped, those before the first do not") {
    Pair pair;
    pair.connection->offer(packet(4, 10), kStart);
    pair.read_to_the_end();
    pair.connection->offer(packet(7, 10), kStart);
    pair.read_to_the_end();
    CHECK(pair.connection->sent() == 2);
    CHECK(pair.connection->dropped() == 2);
}

TEST_CASE(
    "row 74: a receiver that never reads is dropped when its time is over, and newer packets give "
    "it no more") {
    Pair pair;
    CHECK(pair.connection->deadline() == Clock::time_point::max());
    pair.connection->offer(packet(1, kLarge), kStart);
    CHECK(pair.connection->deadline() == kStart + Connection::kPacketTime);
    CHECK(pair.connection->send(kStart));
    pair.connection->offer(packet(2, kLarge), kStart + 4s);
    CHECK(pair.connection->send(kStart + Connection::kPacketTime - 1ns));
    CHECK(pair.connection->deadline() == kStart + Connection::kPacketTime);
    CHECK_FALSE(pair.connection->send(kStart + Connection::kPacketTime));
    CHECK(std::string(pair.connection->end_reason()) ==
          "was dropped, because it did not take a frame within 5 s");
    pair.connection->give_up();
    CHECK(pair.connection->sent() == 0);
    CHECK(pair.connection->dropped() == 2);
}

TEST_CASE("a receiver that takes nothing at all has no more time, though its packet is replaced") {
    Pair pair;
    int size = 0;
    while (::send(pair.connection->socket().get(), &size, sizeof size, MSG_DONTWAIT) > 0) {
    }
    pair.connection->offer(packet(1, 10), kStart);
    REQUIRE(pair.connection->send(kStart));
    pair.connection->offer(packet(2, 10), kStart + 4s);
    CHECK_FALSE(pair.connection->send(kStart + Connection::kPacketTime));
}

TEST_CASE("row 74: a receiver that vanishes within a message raises no signal") {
    void (*const before)(int) = std::signal(SIGPIPE, SIG_DFL);
    Pair pair;
    pair.connection->offer(packet(1, kLarge), kStart);
    REQUIRE(pair.connection->send(kStart));
    pair.receiver = Socket();
    CHECK_FALSE(pair.connection->send(kStart));
    CHECK(std::string(pair.connection->end_reason()) == "is gone");
    std::signal(SIGPIPE, before);
}

TEST_CASE("a receiver that closes without a word is noticed without sending") {
    Pair pair;
    CHECK(pair.connection->discard_input());
    pair.receiver = Socket();
    CHECK_FALSE(pair.connection->discard_input());
}

TEST_CASE(
    "row 74: what a receiver sends is thrown away, up to a limit that begins anew with each "
    "packet") {
    Pair pair;
    for (std::uint64_t number = 1; number <= 3; ++number) {
        pair.write(Connection::kMaxInput);
        pair.connection->offer(packet(number, 1000), kStart);
        CHECK(pair.read_to_the_end() == text_of(packet(number, 1000)));
    }
    pair.write(Connection::kMaxInput);
    char more = '?';
    REQUIRE(::send(pair.receiver.get(), &more, 1, 0) == 1);
    CHECK_FALSE(pair.connection->discard_input());
    CHECK(std::string(pair.connection->end_reason()) ==
          "was dropped, because it sent more than 1 MiB between two frames");
}
