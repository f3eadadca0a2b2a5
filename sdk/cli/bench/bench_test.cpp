#include "sdk/cli/bench/bench.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "sdk/cli/commands/test_run.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

namespace {

// The last line of the text of a run with such times.
std::string last_line(double median, double p99) {
    nlohmann::ordered_json json;
    json["device"] = {{"id", "cpu"}};
    json["size"] = "960x540";
    json["frames"] = json["tracked_frames"] = 100;
    json["stages"] = nlohmann::ordered_json::object();
    json["submit_to_result"] = {{"min_ms", median},
                                {"median_ms", median},
                                {"p99_ms", p99},
                                {"p999_ms", p99},
                                {"max_ms", p99}};
    json["frames_per_second"] = 1000 / median;
    json["peak_memory_mb"] = json["tracker_memory_mb"] = 100.0;
    const std::string text = bench_text(json);
    return text.substr(text.rfind('\n', text.size() - 2) + 1);
}

}  // namespace

TEST_CASE("the last line says for which frame rates the device is fast enough") {
    CHECK(last_line(8, 16) ==
          "fast enough for 25 frames/s: yes; 30 frames/s: yes; 60 frames/s: yes\n");
    CHECK(last_line(12, 35) ==
          "fast enough for 25 frames/s: yes; 30 frames/s: by the median, not by the 99th "
          "percentile; 60 frames/s: by the median, not by the 99th percentile\n");
    CHECK(last_line(50, 60) ==
          "fast enough for 25 frames/s: no; 30 frames/s: no; 60 frames/s: no\n");
}

TEST_CASE("the user's files are measured whole, whatever their name") {
    const TestFolder folder;
    const std::string left = folder / "left\xff", right = folder / "right";
    REQUIRE(run({"render", "heartbeat", "--out", folder.path(), "--frames", "3", "--size",
                 "160x120", "--quiet"}) == 0);
    std::filesystem::rename(folder / "left", left);
    const auto bench = [&] {
        return run({"bench", "--quiet", "--json", "--backend", "cpu", "--frames", "1", "--warm-up",
                    "0", "--no-stages", "--left", left, "--right", right, "--calibration",
                    folder / "calibration.yaml"});
    };
    CHECK(bench() == 0);
    std::vector<std::filesystem::path> images;
    for (const auto& entry : std::filesystem::directory_iterator(right))
        images.push_back(entry.path());
    REQUIRE(images.size() == 3);
    std::filesystem::resize_file(*std::max_element(images.begin(), images.end()), 100);
    CHECK(bench() == 3);
}
