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
