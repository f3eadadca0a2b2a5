// A run with something of everything, for the tests of the reports.
#pragma once
#include <cmath>
#include <limits>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

inline Picture sample_picture(const char* title, uint32_t phase) {
    Picture picture{title, 48, 32, {}};
    for (uint32_t y = 0; y < picture.height; ++y)
        for (uint32_t x = 0; x < picture.width; ++x)
            for (uint32_t k = 0; k < 3; ++k)
                picture.pixels.push_back(static_cast<uint8_t>(
                    128 + 90 * std::sin(0.3 * (x + phase)) * std::cos(0.2 * y + k)));
    return picture;
}

inline CaseRecord sample_case(const char* id, const char* tier, const char* stage,
                              const char* title) {
    CaseRecord c;
    c.id = id;
    c.tier = tier;
    c.stage = stage;
    c.title = title;
    c.verdict = Verdict::passed;
    c.runs = 3;
    c.seconds = 0.125;
    return c;
}

// Every case passed; complete.
inline RunRecord sample_run() {
    RunRecord run;
    run.suite_version = "1";
    run.suite_revision = std::string(40, 'a');
    run.started = "2026-01-02T03:04:05Z";
    run.command = "--plugin defrec_plugin_sample.json --out sample";
    run.seed = 18446744073709551615u;
    run.complete = true;
    run.plugin_name = "sample";
    run.plugin_version = "0.1.0";
    run.plugin_vendor = "Some & Sons";
    run.plugin_library = "defrec_plugin_sample.so";
    run.plugin_sha256 = std::string(64, '0');
    run.device_id = "sample:0";
    run.device_name = "A device <with> \"signs\" & accents: \xC3\xA9";
    run.device_driver = "driver 1.2";
    run.device_kind = 3;
    run.device_features = 1;
    run.device_stages = 0x7F;  // all but warp
    run.system = "Linux 6.1, Debian GNU/Linux 12";
    run.processor = "A processor";
    run.cases.push_back(sample_case("abi/unknown_tail", "abi", "",
                                    "A longer struct is accepted if its tail is zero."));
    run.cases.push_back(sample_case("sequence/heartbeat", "sequence", "",
                                    "Tracks a beating organ as the reference does."));
    run.cases.back().metrics.push_back({"error_to_truth", "mm", 1.4375, 0.8125, 2.0, 1.0, 1600});
    run.cases.back().metrics.push_back(
        {"distance_to_reference", "mm", 0.001, 0.0005, 0.02, 0.01, 8000});
    run.cases.push_back(sample_case("stage/stereo/odd_size", "stage", "stereo",
                                    "Odd sizes give the reference's disparities."));
    run.cases.back().metrics.push_back({"disparity", "1/16 px", 0, 0, 0, 0, 64897});
    run.cases.push_back(sample_case("stage/warp/position", "stage", "warp",
                                    "Warped points lie where the reference puts them."));
    run.cases.back().verdict = Verdict::skipped;
    run.cases.back().reason = "The device does not offer the stage warp.";
    run.cases.back().runs = 0;
    return run;
}

// Two cases failed, one with pictures and one with a figure that is no number.
inline RunRecord sample_failed_run() {
    RunRecord run = sample_run();
    CaseRecord& stereo = run.cases[2];
    stereo.verdict = Verdict::failed;
    stereo.reason = "3 of 64897 disparities differ by up to 16/16 px; \x01 the first at <211, 17>.";
    stereo.metrics[0].maximum = 16;
    stereo.pictures = {sample_picture("expected", 0), sample_picture("found", 1),
                       sample_picture("difference", 30)};
    CaseRecord& sequence = run.cases[1];
    sequence.verdict = Verdict::failed;
    sequence.reason = "A vertex is no number\nin frame 3.";
    sequence.metrics[1].maximum = std::numeric_limits<double>::quiet_NaN();
    sequence.metrics[1].p99 = std::numeric_limits<double>::infinity();
    return run;
}

}  // namespace defrec::conformance
