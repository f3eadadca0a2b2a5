// Row 37: a plugin that aborts or hangs when it is opened is reported. Scripts play the process
// that opens it.
#include "sdk/cli/devices/probe.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cstdlib>
#include <string>

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

TEST_CASE("row 97: only a plugin's manifest is one") {
    const TestFolder folder;
    folder.write("defrec_plugin_x.json", "{}");
    folder.write("stray.json", "{}");
    ::setenv("DEFREC_PLUGIN_PATH", (folder / "").c_str(), 1);
    const std::vector<std::string> manifests = find_manifests();
    ::unsetenv("DEFREC_PLUGIN_PATH");
    REQUIRE(!manifests.empty());
    CHECK(manifests[0].ends_with("defrec_plugin_x.json"));
    for (const std::string& manifest : manifests)
        CHECK(manifest.find("stray") == std::string::npos);
}
