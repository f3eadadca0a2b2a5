// Row 37: a plugin that aborts or hangs when it is opened is reported. Scripts play the process
// that opens it.
#include "sdk/cli/devices/probe.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cstdlib>
#include <string>

#include "sdk/client/library.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

namespace {

ProbeResult probe_with(const std::string& script,
                       std::chrono::milliseconds limit = std::chrono::seconds(20)) {
    const TestFolder folder;
    const std::string program = folder.write("program", "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    return probe_in_child(program, "/plugins/defrec_plugin_x.json", limit);
}

}  // namespace

TEST_CASE("a plugin that works is reported with its devices, and asked for by its manifest") {
    const ProbeResult result = probe_with(
        "[ \"$1 $2 $3\" = 'devices --probe /plugins/defrec_plugin_x.json' ] || exit 9\n"
        "echo '{\"good\": true, \"message\": \"fine\", \"devices\": [\"x:0\"]}'");
    CHECK(result.is_good);
    CHECK(result.message == "fine");
    CHECK(result.devices == std::vector<std::string>{"x:0"});
    CHECK(result.manifest == "/plugins/defrec_plugin_x.json");
}

TEST_CASE("row 37: a plugin that crashes, exits, hangs or talks is reported") {
    CHECK(probe_with("kill -SEGV $$").message.find("crashed") != std::string::npos);
    CHECK(probe_with("kill -ABRT $$").message.find("crashed") != std::string::npos);
    CHECK(probe_with("exit 3").message.find("exit code 3") != std::string::npos);
    CHECK(probe_with("echo nonsense").message.find("exit code 0") != std::string::npos);
    CHECK(probe_with("exec sleep 100", std::chrono::milliseconds(300))
              .message.find("did not answer") != std::string::npos);
    CHECK(probe_with("exec yes", std::chrono::milliseconds(300)).is_good == false);
    CHECK_FALSE(probe_with("exec >&-; exec sleep 100", std::chrono::milliseconds(300)).is_good);
}

TEST_CASE("row 97: a reply that is none is reported, whatever is in it") {
    for (const char* reply : {R"({"good": 1, "message": "", "devices": []})",
                              R"({"good": true, "message": 5, "devices": []})",
                              R"({"good": true, "message": "", "devices": "x"})",
                              R"({"good": true, "message": "", "devices": [7]})",
                              R"({"good": null, "message": {}, "devices": {}})", "[]", "{}"}) {
        CAPTURE(reply);
        const ProbeResult result = probe_with(std::string("echo '") + reply + "'");
        CHECK_FALSE(result.is_good);
        CHECK(result.message.find("exit code 0") != std::string::npos);
    }
}

TEST_CASE("row 97: what is tried are the manifests that the library looks at") {
    const TestFolder folder;
    folder.write("defrec_plugin_x.json", "{}");
    folder.write("stray.json", "{}");
    const TestFolder other;
    const std::string named = other.write("any_name.json", "{}"), gone = folder / "gone";
    const std::string places = (folder / "") + ":relative::" + named + ":" + gone;
    ::setenv("DEFREC_PLUGIN_PATH", places.c_str(), 1);
    const std::string program = other.write(
        "program", "#!/bin/sh\necho '{\"good\": true, \"message\": \"\", \"devices\": []}'\n");
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    const std::vector<ProbeResult> results = probe_all(program, std::chrono::seconds(20));
    const std::vector<Plugin> plugins = list_plugins(open_context({1, true, {}}));
    ::unsetenv("DEFREC_PLUGIN_PATH");
    REQUIRE(results.size() == plugins.size());
    REQUIRE(results.size() > 4);
    for (std::size_t i = 0; i < results.size(); ++i) CHECK(results[i].manifest == plugins[i].path);
    CHECK(results[0].manifest.ends_with("defrec_plugin_x.json"));
    CHECK(results[0].is_good);
    CHECK_FALSE(results[1].is_good);
    CHECK(results[1].message == plugins[1].reason);
    CHECK(results[1].message.find("not an absolute path") != std::string::npos);
    CHECK(results[2].manifest == named);
    CHECK(results[2].is_good);
    CHECK_FALSE(results[3].is_good);
    CHECK(results[3].message.find("no such file or folder") != std::string::npos);
}
