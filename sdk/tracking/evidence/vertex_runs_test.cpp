#include "sdk/tracking/evidence/vertex_runs.hpp"

#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

using defrec::for_each_task;
using defrec::for_phases;
using defrec::for_tasks_and_runs;
using defrec::kMaxVertexThreads;
using defrec::Services;
using defrec::vertex_parts;
using defrec::wait_for;

namespace {

const Services& four_threads() {
    static const Services services([] {
        defrec_context_desc desc{};
        desc.threads = 4;
        return desc;
    }());
    return services;
}

}  // namespace

TEST_CASE("many vertices are several parts, few are one, and without helpers all are one") {
    CHECK(vertex_parts(&four_threads(), 50000) == kMaxVertexThreads);
    CHECK(vertex_parts(&four_threads(), 2500) == 2);
    CHECK(vertex_parts(&four_threads(), 1500) == 1);
    CHECK(vertex_parts(&four_threads(), 0) == 1);
    CHECK(vertex_parts(nullptr, 5000) == 1);
}

TEST_CASE("each part of each phase is done once, after all of the phase before") {
    for (const Services* helpers : {static_cast<const Services*>(nullptr), &four_threads()})
        for (const std::array<size_t, 3>& counts :
             {std::array<size_t, 3>{8, 3, 8}, {1, 3, 1}, {2, 0, 7}})
            for (int round = 0; round < 200; ++round) {
                std::atomic<size_t> visits[3][kMaxVertexThreads] = {};
                std::atomic<size_t> done = 0;
                std::atomic<bool> is_early = false;
                for_phases(helpers, counts, [&](size_t phase, size_t part) {
                    size_t before = 0;
                    for (size_t i = 0; i < phase; ++i) before += counts[i];
                    if (done < before) is_early = true;
                    // Others would have the time to go on.
                    if (round == 0 && part == 0)
                        std::this_thread::sleep_for(std::chrono::milliseconds(5));
                    ++visits[phase][part];
                    ++done;
                });
                CHECK_FALSE(is_early);
                for (size_t phase = 0; phase < counts.size(); ++phase)
                    for (size_t part = 0; part < kMaxVertexThreads; ++part)
                        CHECK(visits[phase][part] == (part < counts[phase] ? 1 : 0));
            }
}

TEST_CASE("each task and each run is done once, on one thread the tasks first") {
    for (const Services* helpers : {static_cast<const Services*>(nullptr), &four_threads()})
        for (const size_t tasks : {0, 1, 7})
            for (const size_t runs : {0, 1, 3, 50}) {
                std::vector<int> task_visits(tasks, 0), run_visits(runs, 0);
                std::atomic<size_t> done = 0;
                std::atomic<bool> is_early = false;
                for_tasks_and_runs(
                    helpers, tasks,
                    [&](size_t task) {
                        ++task_visits[task];
                        ++done;
                    },
                    runs,
                    [&](size_t run) {
                        if (helpers == nullptr && done != tasks) is_early = true;
                        ++run_visits[run];
                    });
                CHECK(task_visits == std::vector<int>(tasks, 1));
                CHECK(run_visits == std::vector<int>(runs, 1));
                CHECK_FALSE(is_early);
            }
}

TEST_CASE("who is kept by a run leaves its others to the threads that are done") {
    constexpr size_t kRuns = 40;
    std::atomic<size_t> done = 0;
    for_tasks_and_runs(
        &four_threads(), 0, [](size_t) {}, kRuns,
        [&](size_t run) {
            if (run == 0) wait_for([&] { return done == kRuns - 1; });
            ++done;
        });
    CHECK(done == kRuns);
}

TEST_CASE("each task is done once, with and without helpers") {
    for (const Services* helpers : {static_cast<const Services*>(nullptr), &four_threads()}) {
        for (const size_t count : {0, 1, 5, 50}) {
            std::vector<int> visits(count, 0);
            for_each_task(helpers, count, [&](size_t task) { ++visits[task]; });
            CHECK(visits == std::vector<int>(count, 1));
        }
    }
}
