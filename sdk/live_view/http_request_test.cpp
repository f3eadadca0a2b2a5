// Requests as browsers send them, and as those do who want something else.
#include "sdk/live_view/http_request.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace defrec::cli;

namespace {

constexpr char kStart[] = "GET /frame?after=7&overlay=1 HTTP/1.1\r\nHost: localhost:80\r\n";

HttpReading read(const std::string& bytes) {
    HttpRequest request;
    return read_request(bytes, request);
}

// 0: not refused.
int refusal(const std::string& bytes) {
    const HttpReading reading = read(bytes);
    CHECK((reading.kind == HttpReading::Kind::kRefused) == (reading.reason != nullptr));
    return reading.kind == HttpReading::Kind::kRefused ? reading.status : 0;
}

}  // namespace

TEST_CASE("a request is read once it is whole, and what follows is the next one's") {
    const std::string head = std::string(kStart) +
                             "x-TOKEN: \t 0123 \r\nOrigin: http://localhost:80\r\nContent-Length: "
                             "2\r\n\r\n";
    const std::string whole = head + "{}";
    for (std::size_t size = 0; size < whole.size(); ++size)
        CHECK(read(whole.substr(0, size)).kind == HttpReading::Kind::kIncomplete);
    HttpRequest request;
    const HttpReading reading = read_request(whole + "GET /", request);
    CHECK(reading.kind == HttpReading::Kind::kWhole);
    CHECK(reading.size == whole.size());
    CHECK(request.method == "GET");
    CHECK(request.path == "/frame");
    CHECK(request.parameter("after") == "7");
    CHECK(request.parameter("overlay") == "1");
    CHECK(request.parameter("over") == "");
    CHECK(request.host == "localhost:80");
    CHECK(request.origin == "http://localhost:80");
    CHECK(request.token == "0123");
    CHECK(request.content == "{}");
    CHECK(request.keeps_open);
    read_request(std::string(kStart) + "Connection: Close\r\n\r\n", request);
    CHECK_FALSE(request.keeps_open);
    CHECK(request.content.empty());
}

TEST_CASE("row 127: a host, an origin, a token or a length that is given twice is refused") {
    CHECK(refusal("GET / HTTP/1.1\r\n\r\n") == 400);
    for (const char* line :
         {"Host: localhost:80", "host:127.0.0.1", "Origin: a\r\nORIGIN: a",
          "X-Token: a\r\nX-Token: a", "Content-Length: 0\r\nContent-Length: 0"}) {
        CAPTURE(line);
        CHECK(refusal(std::string(kStart) + line + "\r\n\r\n") == 400);
    }
    CHECK(refusal(std::string(kStart) + "Origin: a\r\nX-Token: b\r\n\r\n") == 0);
}

TEST_CASE("lines that are none, and what would hide a request in another one, are refused") {
    for (const char* line : {"GET  / HTTP/1.1", "GET / HTTP/2", "GET http://x/ HTTP/1.1", "GET /",
                             "", "G\tT / HTTP/1.1", "GET /\x01 HTTP/1.1", " GET / HTTP/1.1"}) {
        CAPTURE(line);
        CHECK(refusal(std::string(line) + "\r\nHost: localhost\r\n\r\n") == 400);
    }
    for (const char* line : {"no colon", " folded: a", ": a", "a b: c", "Content-Length: -1",
                             "Content-Length: 1, 1", "Content-Length:", "a: \x7f", "a: b\nc: d"}) {
        CAPTURE(line);
        CHECK(refusal(std::string(kStart) + line + "\r\n\r\n") == 400);
    }
    CHECK(refusal(std::string(kStart) + std::string("a: \0", 4) + "\r\n\r\n") == 400);
    CHECK(refusal(std::string(kStart) + "Transfer-Encoding: chunked\r\n\r\n") == 501);
}

TEST_CASE("row 114: heads, headers and contents beyond their limits are refused") {
    const std::string start(kStart);
    CHECK(refusal(start + "Content-Length: 1025\r\n\r\n") == 413);
    CHECK(refusal(start + "Content-Length: 99999999999999999999\r\n\r\n") == 413);
    CHECK(refusal(start + "Content-Length: 1024\r\n\r\n") == 0);
    std::string many = start;
    for (std::size_t i = 0; i < kMaxHeaders; ++i) many += "a: b\r\n";
    CHECK(refusal(many + "\r\n") == 431);
    CHECK(refusal(start + "a: " + std::string(kMaxHead, 'a')) == 431);
    CHECK(refusal(std::string(kMaxHead, 'a')) == 431);
    CHECK(refusal(std::string(kMaxHead - 1, 'a')) == 0);
}
