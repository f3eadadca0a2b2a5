#include "sdk/cli/bench/compare.hpp"

#include <doctest/doctest.h>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/statistics.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;
using Json = nlohmann::ordered_json;

namespace {

Json time(double median, double noise) {
    return {{"min_ms", median}, {"median_ms", median}, {"p99_ms", median}, {"noise_ms", noise}};
}
Json run_of(double stereo, double orb, double noise) {
    Json run;
    run["size"] = "960x540";
    run["sequence"] = "heartbeat";
    run["stages"]["stereo"] = time(stereo, noise);
    run["stages"]["orb"] = time(orb, noise);
    run["stages"]["frame"] = time(stereo + orb, noise);
    run["submit_to_result"] = time(stereo + orb, noise);
    return run;
}
bool is_beyond(const std::vector<ComparedTime>& times, const std::string& name) {
    for (const ComparedTime& time : times)
        if (time.name == name) return time.is_beyond;
    FAIL("there is no " << name);
    return false;
}

}  // namespace

TEST_CASE("a stage is beyond the limit only where it is slower by more than limit and noise") {
    const Json recorded = run_of(10, 2, 0);
    auto times = compare_runs(recorded, run_of(11.1, 2, 0), 0.1);
    CHECK(is_beyond(times, "stereo"));
    CHECK_FALSE(is_beyond(times, "orb"));
    CHECK_FALSE(is_beyond(times, "all stages"));
    CHECK(any_beyond(times));
    CHECK(comparison_text(times, 0.1).find("+11.0 %       0.00  slower") != std::string::npos);

    CHECK_FALSE(any_beyond(compare_runs(recorded, run_of(10.9, 2.1, 0), 0.1)));
    CHECK_FALSE(any_beyond(compare_runs(recorded, run_of(5, 1, 0), 0.1)));
    // 2 sqrt(0.3^2 + 0.4^2) = 1 ms
    times = compare_runs(run_of(10, 2, 0.3), run_of(11.9, 2, 0.4), 0.1);
    CHECK(times[0].noise == doctest::Approx(1));
    CHECK_FALSE(is_beyond(times, "stereo"));
    CHECK(is_beyond(compare_runs(run_of(10, 2, 0.3), run_of(12.1, 2, 0.4), 0.1), "stereo"));
}

TEST_CASE("stages that only one run has are shown and not judged") {
    Json recorded = run_of(10, 2, 0), present = run_of(10, 2, 0);
    recorded["stages"]["lm"] = time(1, 0);
    present["stages"]["lm coarse"] = time(100, 0);
    const auto times = compare_runs(recorded, present, 0.1);
    CHECK_FALSE(any_beyond(times));
    CHECK(times.size() == 6);
    CHECK(times.back().name == "lm");
    CHECK_FALSE(times.back().present.has_value());
    const Json json = comparison_json(times);
    CHECK(json["lm coarse"]["present_ms"] == 100);
    CHECK_FALSE(json["lm coarse"].contains("recorded_ms"));
}

TEST_CASE("runs of another size or sequence are not compared") {
    for (const char* name : {"size", "sequence"}) {
        Json other = run_of(10, 2, 0);
        other[name] = "another";
        CHECK_THROWS_AS(check_comparable(other, run_of(10, 2, 0)), CliError);
        other[name] = "\xff";  // a file's name may be no UTF-8
        CHECK_THROWS_AS(check_comparable(run_of(10, 2, 0), other), CliError);
        other.erase(name);
        CHECK_THROWS_AS(check_comparable(other, run_of(10, 2, 0)), CliError);
    }
}

TEST_CASE("what bench prints is read back, and nothing else is") {
    const TestFolder folder;
    const Json run = run_of(10, 2, 0.1);
    CHECK(read_recorded_run(folder.write("run.json", run.dump(2))) == run);
    for (const char* text : {"", "{", "[]", "{}", R"({"stages": 1})", R"({"stages": {"orb": 1}})",
                             R"({"stages": {"orb": {"median_ms": "1", "noise_ms": 0}}})",
                             R"({"stages": {"orb": {"median_ms": 1}}})",
                             R"({"stages": {}, "submit_to_result": {"median_ms": 1}})"}) {
        CAPTURE(text);
        CHECK_THROWS_AS(read_recorded_run(folder.write("run.json", text)), CliError);
    }
    CHECK_THROWS_AS(read_recorded_run(folder / "absent.json"), CliError);
}

TEST_CASE("the noise of a median follows from the medians of the run's parts") {
    std::vector<double> steady(80, 3.0), halves(80, 3.0);
    CHECK(median_noise(steady) == 0);
    CHECK(median_noise({1, 2, 3}) == 0);  // too few to cut up
    std::fill(halves.begin(), halves.begin() + 40, 4.0);
    // Eight parts, half of them 4 and half 3: standard deviation 0.5, and of a mean of eight less.
    CHECK(median_noise(halves) == doctest::Approx(0.5 / std::sqrt(7.0)));
    halves[5] = 1000;  // one late frame changes nothing
    CHECK(median_noise(halves) == doctest::Approx(0.5 / std::sqrt(7.0)));
}
