// What is UTF-8, and what of it a message shows.
#include "sdk/base/util/utf8.hpp"

#include <doctest/doctest.h>

using defrec::is_utf8;
using defrec::without_controls;

TEST_CASE("row 203: what is UTF-8, and what is not") {
    for (const char* text :
         {"", "vessel", "v\xC3\xA4ne", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF",
          "\xEE\x80\x80", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"}) {
        CAPTURE(text);
        CHECK(is_utf8(text));
    }
    for (const char* text :
         {"\xFF\xFE", "\x80", "a\xBF", "\xC0\x80", "\xC1\xBF", "\xC3", "\xC3(", "\xE0\x9F\xBF",
          "abc\xE2\x82", "\xE2\x82(", "\xED\xA0\x80", "\xF0\x8F\xBF\xBF", "\xF0\x90\x80",
          "\xF4\x90\x80\x80", "\xF5\x80\x80\x80"}) {
        CAPTURE(text);
        CHECK_FALSE(is_utf8(text));
    }
}

TEST_CASE("row 100: a message shows no controls of a text") {
    CHECK(without_controls("v\xC3\xA4ne \xC2\xA0") == "v\xC3\xA4ne \xC2\xA0");
    CHECK(without_controls("\x1B[31mred\x07\x7F") == "?[31mred??");
    CHECK(without_controls("a\xC2\x9B") == "a?");
}
