// A result says in which recording it was tracked, and whether points were given.
#include "sdk/evaluation/score/truth_origin.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

namespace fs = std::filesystem;

namespace {

// Recordings a and b with a truth each, and a result.
struct Folders {
    TestFolder folder;

    Folders() {
        for (const char* name : {"a/left", "b/left", "truths", "out"})
            fs::create_directories(folder.path() / name);
    }

    void summarise(const nlohmann::json& left, const nlohmann::json& points = "points.csv") const {
        folder.write("out/summary.json",
                     nlohmann::json{{"folder", folder.path().string()},
                                    {"input", {{"left", left}, {"points", points}}}}
                         .dump());
    }

    std::string against(const char* truth, bool are_given = true) const {
        return contradiction_of(folder.path() / "out", folder.path() / truth, are_given).why;
    }
};

}  // namespace

TEST_CASE("a truth beside another recording contradicts the result, one beside its own does not") {
    const Folders folders;
    CHECK(folders.against("b/truth.csv").empty());  // there is no summary
    folders.summarise("a/left");
    CHECK(folders.against("a/truth.csv").empty());
    CHECK(folders.against("b/../a/truth.csv").empty());
    CHECK(folders.against("truths/truth.csv").empty());
    const std::string why = folders.against("b/truth.csv");
    CHECK(why.find("out was tracked in ") != std::string::npos);
    CHECK(why.find("b/truth.csv is beside another recording") != std::string::npos);
    folders.summarise((folders.folder.path() / "a/left").string());
    CHECK_FALSE(folders.against("b/truth.csv").empty());
}

TEST_CASE("both views in one file, a pattern or a bag contradict as the left views do") {
    const Folders folders;
    const auto against = [&](const char* input, const std::string& path, const char* truth) {
        folders.folder.write("out/summary.json",
                             nlohmann::json{{"folder", folders.folder.path().string()},
                                            {"input", {{input, path}, {"points", "points.csv"}}}}
                                 .dump());
        return folders.against(truth);
    };
    folders.folder.write("a/both.mp4", "");
    folders.folder.write("a/run.bag", "");
    for (const auto& [input, path] : {std::pair{"stereo", "a/both.mp4"},
                                      {"stereo", "a"},
                                      {"bag", "a/run.bag"},
                                      {"left", "a/left/%06d.png"},
                                      {"left", "a/left_%06d.png"}}) {
        CAPTURE(path);
        CHECK(against(input, path, "a/truth.csv").empty());
        CHECK(against(input, path, "truths/truth.csv").empty());
        CHECK(against(input, path, "b/truth.csv").find("was tracked in ") != std::string::npos);
    }
}

TEST_CASE("points that were not given are not those of a truth") {
    const Folders folders;
    folders.summarise("a/left", nullptr);
    CHECK(folders.against("a/truth.csv").find("was tracked without --points") != std::string::npos);
    CHECK(folders.against("a/truth.csv", false).empty());
}

TEST_CASE("a summary that says nothing of its input contradicts nothing") {
    const Folders folders;
    for (const char* text : {"{}", "[]", "{", R"({"input": {"left": 3}})",
                             R"({"input": {"left": "nowhere"}, "folder": "/"})"}) {
        folders.folder.write("out/summary.json", text);
        CHECK(folders.against("b/truth.csv").empty());
    }
    folders.summarise(nullptr);
    CHECK(folders.against("b/truth.csv").empty());
}
