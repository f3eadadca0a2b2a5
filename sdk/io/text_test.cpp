#include "sdk/io/text.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace defrec::cli;

TEST_CASE("row 100: what a terminal would obey is shown, not sent") {
    CHECK(printable("plain, größe 肝") == "plain, größe 肝");
    CHECK(printable("\x1b[2Ja\nb\x7f") == "\\x1b[2Ja\\x0ab\\x7f");
    CHECK(printable("\xC2\x9B"
                    "1m") == "\\xc2\\x9b1m");
    CHECK(printable(std::string("\0", 1)) == "\\x00");
}

TEST_CASE("names are ordered as people count") {
    CHECK(precedes_by_name("frame_9.png", "frame_10.png"));
    CHECK(precedes_by_name("0009.png", "0010.png"));
    CHECK_FALSE(precedes_by_name("b1", "a2"));
    CHECK(precedes_by_name("a", "a1"));
    CHECK_FALSE(precedes_by_name("a01", "a01"));
    CHECK(precedes_by_name("a01", "a1") != precedes_by_name("a1", "a01"));
}
