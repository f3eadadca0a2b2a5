// What the program calls the library's states and reasons.
#include "sdk/cli/program/library.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <string>
#include <vector>

using namespace defrec::cli;

TEST_CASE("names of states") {
    CHECK(std::string(state_name(DEFREC_INITIALISING)) == "initialising");
    CHECK(std::string(state_name(DEFREC_TRACKING)) == "tracking");
    CHECK(std::string(state_name(DEFREC_DEGRADED)) == "degraded");
    CHECK(std::string(state_name(DEFREC_LOST)) == "lost");
    CHECK(std::string(state_name(DEFREC_RELOCALISED)) == "relocalised");
}

TEST_CASE("names of several reasons") {
    CHECK(reason_names(0, "|") == "");
    CHECK(reason_names(DEFREC_REASON_DARK | DEFREC_REASON_NO_DEPTH | DEFREC_REASON_LOW_CONTRAST,
                       "|") == "dark|no-depth|low-contrast");
}

TEST_CASE("every reason of the C API has its name") {
    std::ifstream layout(DEFREC_SOURCE_DIR "/sdk/abi/layout.txt");
    const std::string prefix = "DEFREC_REASON_";
    std::map<std::uint32_t, std::vector<std::string>> names;  // a value may have earlier names
    for (std::string word, equals, value; layout >> word;) {
        if (word.rfind(prefix, 0) != 0) continue;
        layout >> equals >> value;
        std::string name = word.substr(prefix.size());
        std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) {
            return c == '_' ? '-' : static_cast<char>(std::tolower(c));
        });
        names[static_cast<std::uint32_t>(std::stoul(value))].push_back(name);
    }
    CHECK(names.size() > 10);
    for (const auto& [reason, known] : names)
        CHECK(std::count(known.begin(), known.end(), reason_names(reason, "|")) == 1);
}
