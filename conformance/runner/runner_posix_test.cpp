// The runner on cases of its own, and on a plugin that is sound: what happens to it is in the
// cases' bodies.
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <set>

#include "conformance/runner/runner.hpp"
#include "conformance/worker/message.hpp"

using namespace defrec::conformance;

namespace {

Case make(const char* id, std::function<void(CaseRun&)> body) {
    return {id, "abi", "", "A case of the test.", true, false, std::move(body)};
}

RunOutcome run(const std::vector<Case>& cases,
               std::chrono::seconds time_limit = std::chrono::seconds(60)) {
    const PluginFiles reference = find_backend("reference");
    RunSettings settings;
    settings.time_limit = time_limit;
    return run_cases({reference, reference, ""}, cases, settings);
}

const CaseRecord& record(const RunOutcome& outcome, const std::string& id) {
    const auto found = std::find_if(outcome.cases.begin(), outcome.cases.end(),
                                    [&](const CaseRecord& one) { return one.id == id; });
    REQUIRE(found != outcome.cases.end());
    return *found;
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

RunResult result(Verdict verdict, const char* reason = "", uint64_t digest = 0) {
    return {verdict, reason, {}, {}, digest, 0.5};
}

}  // namespace

TEST_CASE("every case comes as often as asked, in an order that the seed decides") {
    const std::vector<Step> steps = shuffled_steps(20, 3, 1), again = shuffled_steps(20, 3, 1),
                            other = shuffled_steps(20, 3, 2);
    REQUIRE(steps.size() == 60);
    std::set<std::pair<uint32_t, uint32_t>> seen;
    bool same = true, different = false;
    for (size_t i = 0; i < steps.size(); ++i) {
        seen.insert({steps[i].one, steps[i].repetition});
        same = same && steps[i].one == again[i].one && steps[i].repetition == again[i].repetition;
        different = different || steps[i].one != other[i].one;
    }
    CHECK(seen.size() == 60);
    CHECK(same);
    CHECK(different);
    CHECK(shuffled_steps(20, 2, 1).size() == 40);
}

TEST_CASE(
    "the worst of the repetitions counts, and all must be the same bits on a repeatable device") {
    const Case one = make("abi/one", {});
    std::vector<RunResult> results = {result(Verdict::passed), result(Verdict::passed),
                                      result(Verdict::passed)};
    results[0].metrics = {{"position", "mm", 1, 0.5, 2, 2, 10}};
    results[1].metrics = {{"position", "mm", 1.5, 0.4, 2, 2, 10}};
    const CaseRecord merged = merge(one, results, true);
    CHECK(merged.verdict == Verdict::passed);
    CHECK(merged.runs == 3);
    CHECK(merged.seconds == doctest::Approx(1.5));
    REQUIRE(merged.metrics.size() == 1);
    CHECK(merged.metrics[0].maximum == 1.5);
    CHECK(merged.metrics[0].p99 == 0.5);

    results[2].metrics = {{"position", "mm", std::nan(""), 0, 2, 2, 10}};
    CHECK(!merge(one, results, true).metrics[0].passed());
    results[2].digest = 7;
    CHECK(merge(one, results, false).verdict == Verdict::passed);
    CHECK(merge(one, results, true).verdict == Verdict::failed);
    results[1] = result(Verdict::failed, "the second failed");
    results[2] = result(Verdict::failed, "the third too");
    CHECK(merge(one, results, true).reason == "the second failed");
    results = {result(Verdict::skipped, "not offered"), result(Verdict::skipped, "not offered"),
               result(Verdict::skipped, "not offered")};
    CHECK(merge(one, results, true).verdict == Verdict::skipped);
    results[1] = result(Verdict::passed);
    CHECK(merge(one, results, true).verdict == Verdict::failed);
}

TEST_CASE("verdicts, metrics and reasons come back from the worker") {
    const std::vector<Case> cases = {
        make("abi/passes",
             [](CaseRun& run) {
                 run.measure({"position", "mm", 1, 1, 2, 2, 3});
             }),
        make("abi/fails", [](CaseRun&) { fail_case("it is ", 7); }),
        make("abi/beyond",
             [](CaseRun& run) {
                 run.measure({"position", "mm", 3, 1, 2, 2, 3});
                 run.show({"a picture", 1, 1, {1, 2, 3}});
             }),
        make("abi/skips", [](CaseRun&) { skip_case("not today"); }),
        make("abi/throws", [](CaseRun&) { throw 5; }),
        make("abi/differs",
             [](CaseRun& run) {
                 static uint8_t count = 0;  // the worker's
                 ++count;
                 run.digest(std::as_bytes(std::span(&count, 1)));
             }),
    };
    const RunOutcome outcome = run(cases);
    CHECK(outcome.refusal.empty());
    CHECK(outcome.device.id == "reference");
    REQUIRE(outcome.cases.size() == cases.size() + 1);
    CHECK(record(outcome, "abi/passes").verdict == Verdict::passed);
    CHECK(record(outcome, "abi/passes").runs == 3);
    CHECK(record(outcome, "abi/fails").reason == "it is 7");
    CHECK(record(outcome, "abi/beyond").verdict == Verdict::failed);
    CHECK(record(outcome, "abi/beyond").pictures.size() == 1);
    CHECK(record(outcome, "abi/skips").verdict == Verdict::skipped);
    CHECK(record(outcome, "abi/throws").verdict == Verdict::failed);
    CHECK(record(outcome, "abi/differs").verdict == Verdict::failed);
    CHECK(record(outcome, end_of_process_case().id).verdict == Verdict::passed);
}

TEST_CASE("for tools that look at one process, cases run in this one") {
    const PluginFiles reference = find_backend("reference");
    RunSettings settings;
    settings.in_process = true;
    const pid_t here = getpid();
    const std::vector<Case> cases = {
        make("abi/here",
             [here](CaseRun&) {
                 if (getpid() != here) fail_case("another process");
             }),
        make("abi/fails", [](CaseRun&) { fail_case("it is 7"); }),
    };
    const RunOutcome outcome = run_cases({reference, reference, ""}, cases, settings);
    CHECK(record(outcome, "abi/here").verdict == Verdict::passed);
    CHECK(record(outcome, "abi/here").runs == 3);
    CHECK(record(outcome, "abi/fails").reason == "it is 7");
    CHECK(record(outcome, end_of_process_case().id).verdict == Verdict::passed);
}

TEST_CASE(
    "what a plugin does wrong with the host of an instance that a case opened itself fails that "
    "case, and no other") {
    const auto overrun = [](CaseRun& run) {
        const Instance instance(run.subject_plugin());
        const defrec_host& host = *instance.host().table();
        auto* block = static_cast<unsigned char*>(host.alloc(host.self, 10, 8));
        block[10] = 0;
        host.free(host.self, block);
    };
    const std::vector<Case> cases = {
        make("abi/overruns", overrun),
        make("abi/overruns_and_fails",
             [overrun](CaseRun& run) {
                 overrun(run);
                 fail_case("it is something else");
             }),
        make("abi/passes", [](CaseRun& run) { const Instance instance(run.subject_plugin()); }),
    };
    const RunOutcome outcome = run(cases);
    CHECK(contains(record(outcome, "abi/overruns").reason, "bytes behind a block of 10 bytes"));
    CHECK(record(outcome, "abi/overruns_and_fails").reason == "it is something else");
    CHECK(record(outcome, "abi/passes").verdict == Verdict::passed);
    CHECK(record(outcome, end_of_process_case().id).verdict == Verdict::passed);
}

TEST_CASE("a case that crashes or hangs fails with what happened, once, and the others are run") {
    const std::vector<Case> cases = {
        make("abi/crashes",
             [](CaseRun&) {
                 std::signal(SIGABRT, SIG_DFL);  // or the test's own handler would report it
                 std::abort();
             }),
        make("abi/exits", [](CaseRun&) { _exit(3); }),
        make("abi/hangs",
             [](CaseRun&) {
                 for (;;) pause();
             }),
        make("abi/passes", [](CaseRun&) {}),
    };
    const RunOutcome outcome = run(cases, std::chrono::seconds(2));
    CHECK(contains(record(outcome, "abi/crashes").reason, "crashed with signal 6"));
    CHECK(record(outcome, "abi/crashes").runs == 1);
    CHECK(contains(record(outcome, "abi/exits").reason, "ended the process with code 3"));
    CHECK(contains(record(outcome, "abi/hangs").reason, "did not end"));
    CHECK(record(outcome, "abi/passes").verdict == Verdict::passed);
    CHECK(record(outcome, "abi/passes").runs == 3);
    CHECK(record(outcome, end_of_process_case().id).verdict == Verdict::passed);
}

TEST_CASE("a plugin that hangs again and again is given up") {
    std::vector<Case> cases;
    for (int i = 0; i < 12; ++i)
        cases.push_back(make("abi/hangs", [](CaseRun&) {
            for (;;) pause();
        }));
    const RunOutcome outcome = run(cases, std::chrono::seconds(1));
    REQUIRE(outcome.cases.size() == 13);
    CHECK(std::all_of(outcome.cases.begin(), outcome.cases.end(),
                      [](const CaseRecord& one) { return one.verdict == Verdict::failed; }));
    CHECK(std::count_if(outcome.cases.begin(), outcome.cases.end(), [](const CaseRecord& one) {
              return contains(one.reason, "not run");
          }) == 8);
}

TEST_CASE("the same numbers come from random in every repetition, other ones in another case") {
    const std::vector<Case> cases = {make("abi/one", [](CaseRun& run) {
        const uint64_t value = run.random().next();
        run.digest(std::as_bytes(std::span(&value, 1)));
    })};
    CHECK(record(run(cases), "abi/one").verdict == Verdict::passed);
    CHECK(Random("abi/one").next() != Random("abi/two").next());
}

TEST_CASE("messages survive their way, and what is cut short is refused") {
    Message message;
    message.kind = MessageKind::ended;
    message.step = 12;
    message.text = "text";
    message.device.id = "id";
    message.result = {Verdict::failed,
                      "reason",
                      {{"m", "mm", 1, 2, 3, 4, 5}},
                      {{"p", 2, 1, {1, 2, 3, 4, 5, 6}}},
                      77,
                      1.5};
    std::vector<unsigned char> bytes = encode(message);
    const Message back = decode(bytes);
    CHECK(back.step == 12);
    CHECK(back.device.id == "id");
    CHECK(back.result.reason == "reason");
    REQUIRE(back.result.metrics.size() == 1);
    CHECK(back.result.metrics[0].samples == 5);
    REQUIRE(back.result.pictures.size() == 1);
    CHECK(back.result.pictures[0].pixels == std::vector<uint8_t>{1, 2, 3, 4, 5, 6});
    CHECK(encode(back) == bytes);
    for (size_t size = 0; size < bytes.size(); ++size) {
        const std::vector<unsigned char> cut(bytes.begin(), bytes.begin() + std::ptrdiff_t(size));
        CHECK_THROWS_AS(decode(cut), defrec::Error);
    }
    bytes.push_back(0);
    CHECK_THROWS_AS(decode(bytes), defrec::Error);
}
