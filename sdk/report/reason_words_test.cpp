#include "sdk/report/reason_words.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <regex>
#include <sstream>

using namespace defrec::cli;

TEST_CASE("the overlay says reasons in the same words as the pages") {
    std::ifstream file(DEFREC_SOURCE_DIR "/sdk/report/web/reasons.js");
    std::stringstream text;
    text << file.rdbuf();
    std::string script = text.str();
    const std::size_t begin = script.find("const reasons = {");
    REQUIRE(begin != std::string::npos);
    script = script.substr(begin, script.find("};", begin) - begin);
    const std::regex entry("'([a-z-]+)':\\s+'([^']+)'");
    std::vector<std::pair<std::string, std::string>> pages;
    for (std::sregex_iterator i(script.begin(), script.end(), entry), end; i != end; ++i)
        pages.emplace_back((*i)[1], (*i)[2]);
    CHECK(pages.size() > 20);
    const auto& here = reason_words();
    CHECK(pages == std::vector<std::pair<std::string, std::string>>(here.begin(), here.end()));
}

TEST_CASE("names become words, one after the other; what has none stays") {
    CHECK(reasons_in_words("").empty());
    CHECK(reasons_in_words("occluded, other,frozen") ==
          std::vector<std::string>{"something lies in front of the tissue", "other",
                                   "the picture stands still"});
}
