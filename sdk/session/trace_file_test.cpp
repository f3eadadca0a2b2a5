#include "sdk/session/trace_file.hpp"

#include <doctest/doctest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;
using Json = nlohmann::json;

namespace {

defrec_result timed_result() {
    defrec_result result{};
    const char* names[] = {"upload", "stereo", "lm fine"};
    for (const char* name : names) result.times[result.time_count++] = {name, 0.5};
    return result;
}

}  // namespace

TEST_CASE("a trace holds the events with their threads, in microseconds since it was begun") {
    const TestFolder folder;
    const std::string path = folder / "trace.json";
    TraceFile trace(path, "cpu \"quoted\"");
    const auto now = TraceFile::Clock::now();
    trace.add_host("read", 7, now, now + std::chrono::nanoseconds(2500));
    const auto ms = [](int count) { return std::chrono::milliseconds(count); };
    trace.add_device(7, timed_result(), now, now + ms(9));
    CHECK_FALSE(std::filesystem::exists(path));
    trace.commit();

    const Json file = Json::parse(TestFolder::read(path));
    std::vector<Json> slices;
    std::map<int, std::string> threads;
    for (const Json& event : file.at("traceEvents")) {
        CHECK(event.at("pid") == 1);
        if (event.at("ph") == "X") slices.push_back(event);
        if (event.at("name") == "thread_name")
            threads[event.at("tid")] = event.at("args").at("name");
    }
    CHECK(threads ==
          std::map<int, std::string>{{1, "program"}, {2, "device cpu \"quoted\""}, {3, "uploads"}});
    REQUIRE(slices.size() == 5);
    const double begin = slices[0].at("ts");
    CHECK(begin >= 0);
    const auto check = [&](const Json& slice, const char* category, const char* name, int thread,
                           double ts, double duration) {
        CAPTURE(name);
        CHECK(slice.at("cat") == category);
        CHECK(slice.at("name") == name);
        CHECK(slice.at("tid") == thread);
        CHECK(slice.at("args").at("frame") == 7);
        CHECK(slice.at("ts").get<double>() == doctest::Approx(begin + ts));
        CHECK(slice.at("dur").get<double>() == doctest::Approx(duration));
    };
    check(slices[0], "host", "read", 1, 0, 2.5);
    check(slices[1], "frame", "frame", 2, 500, 1000);
    check(slices[2], "upload", "upload", 3, 0, 500);
    check(slices[3], "stage", "stereo", 2, 500, 500);
    check(slices[4], "stage", "lm fine", 2, 1000, 500);
}

TEST_CASE("a frame was on the device before its result was there") {
    const TestFolder folder;
    TraceFile trace(folder / "trace.json", "cpu");
    const auto now = TraceFile::Clock::now();
    trace.add_host("wait", 0, now, now + std::chrono::milliseconds(2));
    trace.add_device(0, timed_result(), now + std::chrono::milliseconds(1),
                     now + std::chrono::milliseconds(2));
    trace.commit();
    std::map<std::string, double> ends;
    const Json file = Json::parse(TestFolder::read(folder / "trace.json"));
    for (const Json& event : file.at("traceEvents"))
        if (event.at("ph") == "X")
            ends[event.at("name")] = event.at("ts").get<double>() + event.at("dur").get<double>();
    CHECK(ends.at("frame") == doctest::Approx(ends.at("wait")));
    CHECK(ends.at("upload") == doctest::Approx(ends.at("wait") - 1000));
}

TEST_CASE("a frame without stages has no slice") {
    const TestFolder folder;
    TraceFile trace(folder / "trace.json", "cpu");
    const auto now = TraceFile::Clock::now();
    trace.add_device(0, defrec_result{}, now, now);
    trace.commit();
    const Json file = Json::parse(TestFolder::read(folder / "trace.json"));
    CHECK(file.at("traceEvents").size() > 1);
    for (const Json& event : file.at("traceEvents")) CHECK(event.at("ph") == "M");
}
