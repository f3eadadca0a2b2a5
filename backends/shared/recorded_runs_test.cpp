// Which sets of buffers are the same, and which is forgotten first.
#include "backends/shared/recorded_runs.hpp"

#include <doctest/doctest.h>

#include <array>
#include <memory>

using namespace defrec;

namespace {

struct Numbered {
    uint64_t number;
    uint64_t serial() const { return number; }
};
using Runs = RecordedRuns<std::unique_ptr<int>, Numbered>;
using Given = std::vector<const Numbered*>;

const Numbered kA{1}, kB{2}, kC{3};

int found(Runs& runs, const Given& in, const Given& out) {
    const auto* run = runs.find(in, out);
    return run == nullptr ? 0 : **run;
}

}  // namespace

TEST_CASE(
    "a run is found for the very same buffers: inputs, outputs, their order, and which were not "
    "given") {
    Runs runs;
    const Given ab{&kA, &kB}, c{&kC};
    CHECK(found(runs, ab, c) == 0);
    CHECK(*runs.add(ab, c, std::make_unique<int>(5)) == 5);
    CHECK(found(runs, ab, c) == 5);
    for (const auto& [in, out] : {std::pair<Given, Given>{{&kB, &kA}, c},
                                  {{&kA}, {&kB, &kC}},
                                  {{&kA, &kB, &kC}, {}},
                                  {{&kA, nullptr}, c},
                                  {{nullptr, &kB}, c},
                                  {{&kA, &kB, nullptr}, c},
                                  {ab, {nullptr}},
                                  {ab, {}},
                                  {ab, {&kA}},
                                  {{}, {}}})
        CHECK(found(runs, in, out) == 0);
    const Given partly{&kA, nullptr};
    runs.add(partly, c, std::make_unique<int>(6));
    CHECK(found(runs, partly, c) == 6);
    CHECK(found(runs, ab, c) == 5);
}

TEST_CASE("a buffer in the place of one that is gone is another") {
    Runs runs;
    Numbered buffer{7};
    const Given in{&buffer};
    runs.add(in, {}, std::make_unique<int>(1));
    buffer.number = 8;
    CHECK(found(runs, in, {}) == 0);
    runs.add(in, {}, std::make_unique<int>(2));
    CHECK(found(runs, in, {}) == 2);
    buffer.number = 7;
    CHECK(found(runs, in, {}) == 1);
}

TEST_CASE("the run that was used longest ago is dropped first") {
    Runs runs;
    const Given a{&kA}, b{&kB}, c{&kC};
    runs.add(a, {}, std::make_unique<int>(1));
    runs.add(b, {}, std::make_unique<int>(2));
    runs.add(c, {}, std::make_unique<int>(3));
    CHECK(found(runs, a, {}) == 1);
    runs.drop_last();
    CHECK(runs.size() == 2);
    CHECK(found(runs, b, {}) == 0);
    CHECK(found(runs, a, {}) == 1);
    CHECK(found(runs, c, {}) == 3);
    runs.clear();
    CHECK(runs.size() == 0);
    CHECK(found(runs, c, {}) == 0);
}
