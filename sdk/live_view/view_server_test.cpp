// The live view's server beside clients that have no token, send slowly, or ask for too much.
#include "sdk/live_view/view_server.hpp"

#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "sdk/io/exit_code.hpp"

using namespace defrec::cli;

namespace {

ViewServer::Handlers handlers() {
    const auto answer_with = [](const std::string& body) {
        return [body](const ViewRequest&) { return ViewAnswer{200, body}; };
    };
    return {answer_with("page"),
            [](const ViewRequest& asked) {
                return ViewAnswer{200, "after " + std::to_string(asked.after) +
                                           (asked.has_overlay ? " with overlay" : "")};
            },
            answer_with(std::string(1'000'000, 's')),
            answer_with("checks"),
            [](const ViewRequest& asked) {
                return ViewAnswer{202, std::string(asked.body)};
            },
            answer_with("recording")};
}

std::uint16_t port_of(const ViewServer& server) {
    return static_cast<std::uint16_t>(
        std::atoi(server.url().c_str() + server.url().rfind(':') + 1));
}
std::string token_of(const ViewServer& server) {
    return server.url().substr(server.url().find("token=") + 6);
}

class Client {
  public:
    explicit Client(std::uint16_t port)
        : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        REQUIRE(socket_);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(port);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        REQUIRE(::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address),
                          sizeof address) == 0);
    }

    // False: the server has closed.
    bool send(const std::string& bytes) const {
        return ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
               static_cast<ssize_t>(bytes.size());
    }
    // Whether the server has closed by now.
    bool is_closed() const {
        pollfd polled{socket_.get(), POLLIN, 0};
        char byte = 0;
        return ::poll(&polled, 1, 0) == 1 &&
               ::recv(socket_.get(), &byte, 1, MSG_PEEK | MSG_DONTWAIT) <= 0;
    }
    void wait_until_closed() const {
        std::array<char, 4096> bytes{};
        while (::recv(socket_.get(), bytes.data(), bytes.size(), 0) > 0) {
        }
    }
    // An answer whole, with its head; less where the server closed before.
    std::string answer() const {
        std::string text;
        std::array<char, 65536> bytes{};
        std::size_t size = std::string::npos;
        while (text.size() < size) {
            const ssize_t count = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
            if (count <= 0) break;
            text.append(bytes.data(), static_cast<std::size_t>(count));
            const std::size_t head = text.find("\r\n\r\n");
            if (head == std::string::npos) continue;
            const std::size_t length = text.find("Content-Length: ");
            size = head + 4;
            if (length < head) size += std::strtoul(text.c_str() + length + 16, nullptr, 10);
        }
        return text;
    }

  private:
    Socket socket_;
};

std::string request_for(const ViewServer& server, const std::string& what,
                        const std::string& more = "", const std::string& host = "localhost") {
    return what + " HTTP/1.1\r\nHost: " + host + "\r\nX-Token: " + token_of(server) + "\r\n" +
           more + "\r\n";
}

// 0: none came.
int status_of(const std::string& answer) {
    return answer.starts_with("HTTP/1.1 ") ? std::atoi(answer.c_str() + 9) : 0;
}

int status_for(const ViewServer& server, const std::string& request) {
    const Client client(port_of(server));
    client.send(request);
    return status_of(client.answer());
}

std::string content_of(const std::string& answer) {
    return answer.substr(answer.find("\r\n\r\n") + 4);
}

}  // namespace

TEST_CASE("requests one after the other, and two at once, are answered in their order") {
    const ViewServer server(0, handlers());
    const Client client(port_of(server));
    client.send(request_for(server, "GET /frame?after=3&overlay=1"));
    CHECK(content_of(client.answer()) == "after 3 with overlay");
    client.send(request_for(server, "POST /points", "Content-Length: 2\r\n") + "{}" +
                request_for(server, "GET /frame?after=-1"));
    const std::string both = client.answer();
    CHECK(status_of(both) == 202);
    const std::string rest = content_of(both);
    CHECK(rest.starts_with("{}"));
    CHECK(content_of(rest.size() > 2 ? rest : client.answer()).ends_with("after -1"));
    CHECK(status_for(server, request_for(server, "GET /nothing")) == 404);
    CHECK(status_for(server, request_for(server, "HEAD /surface")) == 404);
}

TEST_CASE("row 112: the server ends while clients without the token send on, slowly") {
    std::optional<ViewServer> server(std::in_place, 0, handlers());
    std::vector<Client> clients;
    for (int i = 0; i < 20; ++i) {
        clients.emplace_back(port_of(*server));
        clients.back().send("GET / HTTP/1.1\r\nHost: localhost\r\n");
    }
    std::atomic<bool> has_ended{false};
    std::thread dripping([&] {
        while (!has_ended)
            for (const Client& client : clients) client.send("a: b\r\n");
    });
    // None of their requests ever ends.
    server.reset();
    has_ended = true;
    dripping.join();
    for (const Client& client : clients) client.wait_until_closed();
}

TEST_CASE(
    "row 113: of many connections without the token 32 are open, and the token gets through") {
    const ViewServer server(0, handlers());
    const Client before(port_of(server));
    before.send(request_for(server, "GET /checks"));
    CHECK(status_of(before.answer()) == 200);
    std::vector<Client> clients;
    for (int i = 0; i < 300; ++i) {
        clients.emplace_back(port_of(server));
        if (i % 50 == 0) CHECK(status_for(server, request_for(server, "GET /checks")) == 200);
    }
    // The server has looked at all of them once this is answered.
    const Client after(port_of(server));
    after.send(request_for(server, "GET /checks"));
    CHECK(status_of(after.answer()) == 200);
    std::size_t open = 0;
    for (const Client& client : clients) open += !client.is_closed();
    CHECK(open <= ViewServer::kMaxConnections);
    CHECK(open > 0);
    // Whoever has shown the token keeps the place.
    before.send(request_for(server, "GET /checks"));
    CHECK(status_of(before.answer()) == 200);
}

TEST_CASE("row 113: with few descriptors fewer connections are taken") {
    rlimit limit{};
    REQUIRE(::getrlimit(RLIMIT_NOFILE, &limit) == 0);
    const rlimit few{64, limit.rlim_max};
    REQUIRE(::setrlimit(RLIMIT_NOFILE, &few) == 0);
    const ViewServer server(0, handlers());
    REQUIRE(::setrlimit(RLIMIT_NOFILE, &limit) == 0);
    std::vector<Client> clients;
    for (int i = 0; i < 30; ++i) clients.emplace_back(port_of(server));
    CHECK(status_for(server, request_for(server, "GET /checks")) == 200);
    std::size_t open = 0;
    for (const Client& client : clients) open += !client.is_closed();
    CHECK(open <= 8);
}

TEST_CASE("row 113: where all have shown the token a further connection is closed") {
    const ViewServer server(0, handlers());
    std::vector<Client> clients;
    for (std::size_t i = 0; i < ViewServer::kMaxConnections; ++i) {
        clients.emplace_back(port_of(server));
        clients.back().send(request_for(server, "GET /checks"));
        CHECK(status_of(clients.back().answer()) == 200);
    }
    Client(port_of(server)).wait_until_closed();
    clients.front().send(request_for(server, "GET /checks"));
    CHECK(status_of(clients.front().answer()) == 200);
}

TEST_CASE(
    "row 114: clients that send slowly shut nobody out, and are dropped when their time ends") {
    const ViewServer server(0, handlers());
    std::vector<Client> clients;
    for (int i = 0; i < 40; ++i) {
        clients.emplace_back(port_of(server));
        clients.back().send("GET / HTTP/1.1\r\n");
    }
    CHECK(status_for(server, request_for(server, "GET /checks")) == 200);
    // A header now and then does not prolong it.
    while (clients.back().send("a: b\r\n")) std::this_thread::sleep_for(std::chrono::seconds(1));
    for (const Client& client : clients) client.wait_until_closed();
    CHECK(status_for(server, request_for(server, "GET /checks")) == 200);
}

TEST_CASE("row 114: ranges are ignored") {
    const ViewServer server(0, handlers());
    std::string ranges = "Range: bytes=0-0";
    for (int i = 0; i < 1500; ++i) ranges += ",0-";
    const Client client(port_of(server));
    client.send(request_for(server, "GET /surface", ranges + "\r\n"));
    const std::string answer = client.answer();
    CHECK(status_of(answer) == 200);
    CHECK(content_of(answer) == std::string(1'000'000, 's'));
}

TEST_CASE("row 127: two hosts or two origins are refused") {
    const ViewServer server(0, handlers());
    CHECK(status_for(server, request_for(server, "GET /checks", "Host: localhost\r\n")) == 400);
    CHECK(status_for(server, request_for(server, "GET /checks",
                                         "Origin: http://localhost\r\nOrigin: null\r\n")) == 400);
}

TEST_CASE("a tunnel may end at any port of this computer, and at no other name") {
    const ViewServer server(0, handlers());
    const auto status = [&](const std::string& host, const std::string& origin = "") {
        const std::string header = origin.empty() ? "" : "Origin: " + origin + "\r\n";
        return status_for(server, request_for(server, "GET /checks", header, host));
    };
    for (const char* host : {"localhost:9999", "127.0.0.1:1", "[::1]:65535", "localhost"})
        CHECK(status(host) == 200);
    for (const char* host : {"evil.example:9999", "localhost.evil.example",
                             "127.0.0.1.evil.example", "localhost:", "localhost:123456",
                             "localhost:80@evil.example", "", "127.0.0.2", "127.0.0.1:80:80"})
        CHECK(status(host) == 403);
    CHECK(status("localhost:9999", "http://localhost:9999") == 200);
    // Another server's page on this computer.
    CHECK(status("localhost:9999", "http://localhost:8000") == 403);
    CHECK(status("localhost:9999", "http://127.0.0.1:9999") == 403);
}

TEST_CASE("the port can be taken again at once") {
    std::optional<ViewServer> server(std::in_place, 0, handlers());
    const std::uint16_t port = port_of(*server);
    const Client client(port);
    client.send(request_for(*server, "GET /checks"));
    CHECK(status_of(client.answer()) == 200);
    // The server closes first, so its end of the connection stays in TIME_WAIT.
    server.reset();
    client.wait_until_closed();
    server.emplace(port, handlers());
    CHECK(port_of(*server) == port);
    CHECK_THROWS_AS(ViewServer(port, handlers()), CliError);
}
