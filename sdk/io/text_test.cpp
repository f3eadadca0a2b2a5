#include "sdk/io/text.hpp"

#include <doctest/doctest.h>

#include <string>

#include "sdk/io/counted.hpp"

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

TEST_CASE("one of a thing is singular, any other number of it plural") {
    CHECK(counted(0, "frame") == "0 frames");
    CHECK(counted(1, "frame") == "1 frame");
    CHECK(counted(2, "frame") == "2 frames");
    CHECK(counted(1, "part of the plan", "parts of the plan") == "1 part of the plan");
    CHECK(counted(12, "part of the plan", "parts of the plan") == "12 parts of the plan");
}
