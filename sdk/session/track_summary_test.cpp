// The end text of a run.
#include "sdk/session/track_summary.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace defrec::cli;

namespace {

using Json = nlohmann::ordered_json;

Json shares(std::size_t count) {
    return {
        {"count", count}, {"tracked_share", 1.0}, {"extrapolated_share", 0.0}, {"lost_share", 0.0}};
}

// A run in which there is so much of everything.
Json summary_of(std::size_t count) {
    Json summary;
    summary["frames"] = count;
    summary["device"] = {{"id", "cpu"}};
    summary["states"] = {{"tracking", count}, {"lost", 0}};
    summary["doubtful"] = Json::array();
    summary["template_file"] = nullptr;
    summary["template_frame"] = 0;
    summary["points"] = summary["targets"] = shares(count);
    summary["plan"] = {{"targets", shares(count)}, {"parts", shares(count)}};
    summary["stages"] = {{"frame", {{"median_ms", 8.0}, {"p99_ms", 9.0}}}};
    return summary;
}

std::string text_of(std::size_t count) { return summary_text(summary_of(count), "out"); }

}  // namespace

TEST_CASE("the end text counts one in the singular, more in the plural") {
    const std::string shared = ": 100.0 % tracked, 0.0 % extrapolated, 0.0 % lost\n";
    const std::string placed = ": 100.0 % placed, 0.0 % lost\n";
    const std::string end =
        "a frame takes 8.0 ms (median), 9.0 ms (99th percentile)\nreport: out/report.html\n";
    CHECK(text_of(1) == "1 frame on cpu: 1 tracking\ntemplate of frame 0\n1 point" + shared +
                            "1 target" + shared + "1 target of the plan" + placed +
                            "1 part of the plan" + placed + end);
    CHECK(text_of(3) == "3 frames on cpu: 3 tracking\ntemplate of frame 0\n3 points" + shared +
                            "3 targets" + shared + "3 targets of the plan" + placed +
                            "3 parts of the plan" + placed + end);
}

TEST_CASE("the end text says which frames are lost or degraded, and why, in a few lines") {
    Json summary = summary_of(90);
    for (std::size_t i = 1; i < 6; ++i)
        summary["doubtful"].push_back({{"frames", i}, {"text", "text " + std::to_string(i)}});
    const std::string text = summary_text(summary, "out");
    CHECK(text.find("90 tracking\n  text 1\n  text 2\n  text 3\n  9 further frames are in doubt: "
                    "see reasons in frames.csv\ntemplate") != std::string::npos);
}

TEST_CASE("the end text says of a plan's part without a middle how much of it is known") {
    Json summary = summary_of(1);
    summary["plan"]["parts"] = {
        {"count", 1},         {"tracked_share", 0.0},      {"extrapolated_share", 0.25},
        {"lost_share", 0.75}, {"partly_known_share", 0.5}, {"known_share", 0.98}};
    CHECK(summary_text(summary, "out")
              .find("1 part of the plan: 25.0 % placed, 50.0 % partly known (98.0 % of the "
                    "vertices), 25.0 % lost\n") != std::string::npos);
}

TEST_CASE("the end text names the file of a template that was given, and no frame") {
    Json summary = summary_of(1);
    summary["template_file"] = "organ.template";
    summary["template_frame"] = nullptr;
    const std::string text = summary_text(summary, "out");
    CHECK(text.find("\ntemplate of organ.template\n") != std::string::npos);
    CHECK(text.find("template of frame") == std::string::npos);
}
