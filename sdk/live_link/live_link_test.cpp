// The link as tracking uses it: frames published by one thread, sent by another, received by
// OpenIGTLink's own sockets.
#include "sdk/live_link/live_link.hpp"

#include <doctest/doctest.h>
#include <igtlClientSocket.h>
#include <igtlOSUtil.h>
#include <igtlServerSocket.h>

#include <atomic>
#include <csignal>
#include <memory>
#include <thread>

#include "sdk/live_link/test_port.hpp"
#include "sdk/live_link/test_receiver.hpp"

using namespace defrec::cli;

namespace {

const LinkOptions kListen{LinkOptions::Kind::kListen, {"127.0.0.1", 0}};

igtl::ClientSocket::Pointer connect_to(const LiveLink& link) {
    auto socket = igtl::ClientSocket::New();
    REQUIRE(socket->ConnectToServer("127.0.0.1", link.endpoint().port) == 0);
    return socket;
}

// Receives until the stream ends while the link is finished in a thread of its own.
std::vector<ReceivedFrame> receive_to_the_end(LiveLink& link, igtl::Socket& socket,
                                              LinkCounts* counts = nullptr) {
    std::thread finisher([&] {
        const LinkCounts all = link.finish();
        if (counts != nullptr) *counts = all;
    });
    std::vector<ReceivedFrame> frames;
    FrameReader reader(from_socket(socket));
    while (auto frame = reader.next()) frames.push_back(std::move(*frame));
    socket.CloseSocket();
    finisher.join();
    return frames;
}

}  // namespace

TEST_CASE("the last frame arrives whole, however many came before it") {
    LiveLink link(kListen);
    const auto socket = connect_to(link);
    constexpr int kFrames = 200;
    LinkFrame last;
    for (int i = 0; i < kFrames; ++i) link.publish(last = example_frame(i));
    LinkCounts counts;
    const std::vector<ReceivedFrame> frames = receive_to_the_end(link, *socket, &counts);
    REQUIRE_FALSE(frames.empty());
    CHECK(frames.back().index == kFrames - 1);
    CHECK(frames.back().vertices == last.vertices);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        CHECK(frames[i].messages.size() == 6);
        if (i > 0) CHECK(frames[i].index > frames[i - 1].index);
    }
    CHECK(counts.receivers == 1);
    CHECK(counts.sent == frames.size());
    CHECK(counts.sent + counts.dropped ==
          static_cast<std::uint64_t>(kFrames - frames.front().index));
}

TEST_CASE("row 74: a receiver that never reads holds up neither tracking nor other receivers") {
    LiveLink link(kListen);
    const auto stuck = connect_to(link);
    const auto good = connect_to(link);
    std::atomic<bool> is_enough = false;
    std::thread publisher([&] {
        for (std::int64_t i = 0; !is_enough; ++i)
            link.publish(i < 3 ? large_frame(i) : example_frame(i));
    });
    FrameReader reader(from_socket(*good));
    constexpr std::int64_t kLater = 1000;
    std::int64_t last = -1;
    while (last < kLater) {
        const auto frame = reader.next();
        if (!frame) break;
        last = frame->index;
    }
    is_enough = true;
    publisher.join();
    CHECK(last >= kLater);
    // The link would wait for them.
    good->CloseSocket();
    stuck->CloseSocket();
    CHECK(link.finish().receivers == 2);
}

TEST_CASE(
    "a server that listens is connected to, and gets the last frame though it was published "
    "before") {
    auto server = igtl::ServerSocket::New();
    REQUIRE(server->CreateServer(0) == 0);
    LiveLink link({LinkOptions::Kind::kConnect,
                   {"127.0.0.1", static_cast<std::uint16_t>(server->GetServerPort())}});
    link.publish(example_frame(3));
    std::thread finisher([&] { link.finish(); });
    const auto socket = server->WaitForConnection();
    REQUIRE(socket.IsNotNull());
    CHECK(FrameReader(from_socket(*socket)).last().index == 3);
    socket->CloseSocket();
    finisher.join();
}

TEST_CASE("the link closes after its receivers, so that nothing that is under way is lost") {
    void (*const before)(int) = std::signal(SIGPIPE, SIG_IGN);
    auto link = std::make_unique<LiveLink>(kListen);
    const auto socket = connect_to(*link);
    link->publish(example_frame());
    std::thread finisher([&] {
        link->finish();
        link.reset();
    });
    CHECK(FrameReader(from_socket(*socket)).last().index == 7);
    // The stream has ended in one direction. A closed link would answer these with a reset; the
    // pauses let one that closes too early do so.
    int sent = 0;
    for (; sent < 100 && socket->Send("?", 1) == 1; ++sent) igtl::Sleep(2);
    CHECK(sent == 100);
    socket->CloseSocket();
    finisher.join();
    std::signal(SIGPIPE, before);
}

TEST_CASE("nobody there: publishing and ending go on as ever") {
    LiveLink listening(kListen);
    for (int i = 0; i < 10; ++i) listening.publish(example_frame(i));
    CHECK(listening.finish().receivers == 0);

    const TestPort port;
    LiveLink connecting({LinkOptions::Kind::kConnect, port.endpoint()});
    connecting.publish(example_frame());
    CHECK(connecting.finish().receivers == 0);
    const std::vector<std::string> notices = connecting.take_notices();
    REQUIRE(notices.size() == 1);
    CHECK(notices[0].find("nobody is reached") != std::string::npos);
}

TEST_CASE("a link that is given up does not wait for its receivers") {
    igtl::ClientSocket::Pointer stuck;
    {
        LiveLink link(kListen);
        stuck = connect_to(link);
        link.publish(large_frame());
    }
    CHECK(stuck->GetConnected());
}
