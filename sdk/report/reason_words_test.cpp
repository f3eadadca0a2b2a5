#include "sdk/report/reason_words.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <map>
#include <regex>
#include <sstream>

using namespace defrec::cli;

namespace {

std::string page_script(const std::string& name) {
    std::ifstream file(DEFREC_SOURCE_DIR "/sdk/report/web/" + name);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

// The entries of a table of the pages.
std::map<std::string, std::string> table_of(const std::string& script, const std::string& name) {
    const std::size_t begin = script.find("const " + name + " = {");
    REQUIRE(begin != std::string::npos);
    const std::string text = script.substr(begin, script.find("};", begin) - begin);
    const std::regex entry("'([a-z-]+)':\\s+'([^']+)'");
    std::map<std::string, std::string> table;
    for (std::sregex_iterator i(text.begin(), text.end(), entry), end; i != end; ++i)
        table[(*i)[1]] = (*i)[2];
    return table;
}

}  // namespace

TEST_CASE("reasons have the same words and remedies here and in the pages") {
    const std::string text = page_script("reasons.js");
    std::map<std::string, std::string> words, remedies, of_one;
    for (const ReasonWords& reason : reason_words()) {
        words[std::string(reason.name)] = reason.words;
        if (!reason.remedy.empty()) remedies[std::string(reason.name)] = reason.remedy;
        if (!reason.of_one.empty()) of_one[std::string(reason.name)] = reason.of_one;
    }
    CHECK(words.size() > 20);
    CHECK(table_of(text, "reasons") == words);
    CHECK(table_of(text, "remedies") == remedies);
    CHECK(table_of(text, "ofOne") == of_one);
}

TEST_CASE("states have the same words here and in the pages") {
    std::map<std::string, std::string> words;
    for (const StateWord& state : state_words()) words[std::string(state.name)] = state.word;
    CHECK(words.size() == 12);
    CHECK(table_of(page_script("colours.js"), "stateWords") == words);
    CHECK(word_of_state("degraded") == "Less sure");
    CHECK(word_of_state("other") == "other");
}

TEST_CASE("names become words, what explains most first; what has none stays") {
    CHECK(reasons_in_words("", "").empty());
    CHECK(reasons_in_words("occluded, other,frozen", "both") ==
          std::vector<std::string>{"the picture stands still",
                                   "something lies in front of the tissue", "other"});
}

TEST_CASE("the picture that a reason speaks of is named, and each thing said once") {
    using Words = std::vector<std::string>;
    CHECK(reasons_in_words("dark|no-texture|one-view", "right") ==
          Words{"the right picture is black"});
    CHECK(reasons_in_words("saturated|one-view", "left") == Words{"the left picture is white"});
    CHECK(reasons_in_words("dark|no-texture|frozen", "both") == Words{"both pictures are black"});
    CHECK(reasons_in_words("dark|saturated|no-texture", "both") ==
          Words{"a picture is black", "a picture is white"});
    CHECK(reasons_in_words("one-view", "right") == Words{"the right picture is missing"});
    CHECK(reasons_in_words("dark|one-view|frozen", "right") ==
          Words{"the right picture is black", "the left picture stands still"});
    CHECK(reasons_in_words("view-late", "left") == Words{"the left picture stands still"});
    CHECK(reasons_in_words("view-late", "") ==
          Words{"left and right picture are not of the same time"});
    CHECK(
        reasons_in_words("view-late|frozen", "right") ==
        Words{"the right picture stands still", "left and right picture are not of the same time"});
    CHECK(reasons_in_words("no-depth|view-late|frozen", "both") ==
          Words{"the picture stands still", "left and right picture are not of the same time",
                "too little depth is measured"});
}

TEST_CASE("what to do is about the picture that is named") {
    const auto remedy = [](const char* reasons, const char* views) {
        return remedy_of(told_reasons(reasons, views).at(0), "degraded");
    };
    CHECK(remedy("dark|one-view", "right") == "check lens, cable and input of that view");
    CHECK(remedy("dark", "both") == "check light, lens and cable");
    CHECK(remedy("view-late", "right") == "check that video input");
    CHECK(remedy("view-late", "") == "synchronise both views");
    CHECK(remedy("frozen", "both") == "check the video source");
}

TEST_CASE("the pages say reasons in the same order") {
    const std::string text = page_script("reasons.js");
    std::size_t last = 0;
    for (const ReasonWords& reason : reason_words()) {
        const std::size_t at = text.find("\n  '" + std::string(reason.name) + "': '");
        CHECK_MESSAGE(at > last, reason.name);
        last = at;
    }
}

TEST_CASE("few matches ask for something where the tissue is lost") {
    const auto remedy = [](const char* reason, const char* state) {
        return remedy_of(told_reasons(reason, "").at(0), state);
    };
    CHECK(remedy("few-matches", "degraded").empty());
    CHECK_FALSE(remedy("few-matches", "lost").empty());
    CHECK_FALSE(remedy("occluded", "degraded").empty());
    CHECK(remedy("other", "lost").empty());
}
