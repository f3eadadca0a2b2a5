// The page's data: base64, quantised positions, and text that is safe inside a script element.
#include "sdk/report/page_json.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

using namespace defrec::cli;
using nlohmann::json;

TEST_CASE("base64 agrees with the examples of RFC 4648") {
    const char* const examples[][2] = {{"", ""},
                                       {"f", "Zg=="},
                                       {"fo", "Zm8="},
                                       {"foo", "Zm9v"},
                                       {"foob", "Zm9vYg=="},
                                       {"fooba", "Zm9vYmE="},
                                       {"foobar", "Zm9vYmFy"}};
    for (const auto& [plain, coded] : examples)
        CHECK(base64(plain, std::string(plain).size()) == coded);
}

TEST_CASE("quantised positions are within half a step, and places without one stay so") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> xyz{-12.5f, 3, 80, 40, -7.25f, 95.5f, nan, nan, nan, 0.125f, 1, 81};
    const QuantisedPoints points = quantise(xyz);
    for (std::size_t i = 0; i < xyz.size(); ++i) {
        if (std::isnan(xyz[i])) continue;
        const float back = points.lowest[i % 3] + points.step[i % 3] * points.xyz[i];
        CHECK(std::abs(back - xyz[i]) <= 0.51f * points.step[i % 3] + 1e-5f);
        CHECK(points.step[i % 3] < 0.001f);
    }
    CHECK(points.xyz[6] == 65535);
    CHECK(points.xyz[0] != 65535);
}

TEST_CASE("a flat or empty set of points quantises") {
    CHECK(quantise({1, 2, 3, 1, 2, 3}).lowest[2] == 3);
    CHECK(quantise({}).xyz.empty());
}

TEST_CASE("embedded text cannot leave its element and parses to what it was") {
    const json value{{"name", "</script><!-- & \xe2\x80\xa8 \"quoted\" \\ \xc3\xa4"}};
    const std::string text = embeddable(value);
    CHECK(text.find_first_of("<>&") == std::string::npos);
    for (const char c : text) CHECK(static_cast<unsigned char>(c) < 0x80);
    CHECK(json::parse(text) == value);
    CHECK_NOTHROW(embeddable(json{{"bad", "\xff\xfe"}}));
}
