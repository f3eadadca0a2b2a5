// What --igtl and --igtl-listen take.
#include "sdk/live_link/endpoint.hpp"

#include <doctest/doctest.h>

#include "sdk/io/exit_code.hpp"

using namespace defrec::cli;

TEST_CASE("a target is a host and a port") {
    for (const char* text : {"localhost:18944", "10.0.0.7:1", "[::1]:65535"})
        CHECK(to_string(parse_target(text)) == text);
    CHECK(parse_target("[fe80::1]:2").host == "fe80::1");
    for (const char* text : {"", ":", "localhost", "localhost:", ":18944", "localhost:0",
                             "localhost:65536", "localhost:70000", "localhost:-1", "localhost:1x",
                             "localhost:18944 ", "::1:18944", "[::1:18944", "[]:18944"}) {
        CAPTURE(text);
        CHECK_THROWS_AS(parse_target(text), CliError);
    }
}

TEST_CASE("a listener's address is the loopback unless one is given") {
    CHECK(to_string(parse_listener("18944")) == "127.0.0.1:18944");
    CHECK(to_string(parse_listener("0")) == "127.0.0.1:0");
    CHECK(to_string(parse_listener("0.0.0.0:18944")) == "0.0.0.0:18944");
    CHECK(to_string(parse_listener("[::]:18944")) == "[::]:18944");
    for (const char* text :
         {"", "all", "70000", "-1", ":18944", "0.0.0.0:", "0.0.0.0:70000", "::1"}) {
        CAPTURE(text);
        CHECK_THROWS_AS(parse_listener(text), CliError);
    }
}
