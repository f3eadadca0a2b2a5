#include "sdk/tracking/vertex_runs.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <vector>

using defrec::for_each_task;
using defrec::for_runs;
using defrec::for_tasks_and_runs;
using defrec::Services;

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

TEST_CASE("many vertices are several runs, few are one, and without helpers all are one") {
    const auto runs = [](const Services* helpers, size_t count) {
        std::atomic<int> calls{0};
        for_runs(helpers, count, [&](size_t, size_t) { ++calls; });
        return calls.load();
    };
    CHECK(runs(&four_threads(), 5000) == 4);
    CHECK(runs(&four_threads(), 2500) == 2);
    CHECK(runs(&four_threads(), 1500) == 1);
    CHECK(runs(nullptr, 5000) == 1);
}

TEST_CASE("runs cover every vertex once, with and without helpers") {
    for (const Services* helpers : {static_cast<const Services*>(nullptr), &four_threads()})
        for (const size_t count : {0, 1, 1023, 1024, 2048, 4097, 50001}) {
            std::vector<int> visits(count, 0);
            for_runs(helpers, count, [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; ++i) ++visits[i];
            });
            CAPTURE(count);
            CHECK(visits == std::vector<int>(count, 1));
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

TEST_CASE("each task is done once, with and without helpers") {
    for (const Services* helpers : {static_cast<const Services*>(nullptr), &four_threads()}) {
        for (const size_t count : {0, 1, 5, 50}) {
            std::vector<int> visits(count, 0);
            for_each_task(helpers, count, [&](size_t task) { ++visits[task]; });
            CHECK(visits == std::vector<int>(count, 1));
        }
    }
}
