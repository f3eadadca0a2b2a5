// Loops over vertices in which the context's threads take part.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <thread>

#include "sdk/base/os/services.hpp"
#include "sdk/base/os/spin.hpp"
#include "sdk/base/util/array_part.hpp"

namespace defrec {

constexpr size_t kMaxVertexThreads = 8;  // each that is woken costs the caller a system call

// Waits for what another thread has begun to do, which may be kept from going on.
template <class Condition>
void wait_for(Condition condition) {
    constexpr std::chrono::microseconds kSpin{100}, kSleep{50};
    while (!spin_until(kSpin, condition)) std::this_thread::sleep_for(kSleep);
}

// Calls take_part(0 .. threads - 1), each once, and returns when all have returned. helpers: whose
// threads take part; nullptr: none, and the caller alone is thread 0.
template <class TakePart>
void on_threads(const Services* helpers, size_t threads, const TakePart& take_part) {
    if (helpers != nullptr)
        helpers->parallel_for(threads, take_part);
    else
        take_part(0);
}

// Phases of a loop in which threads stay until it is done: a phase begins when that before it has
// ended. Calls part(phase, 0 .. counts[phase] - 1), each once, and returns when all have returned.
// A thread begins with the part that has its number, of whose vertices it may have something in
// its cache. At most kMaxVertexThreads parts in a phase; they must not throw.
template <size_t kPhases, class Part>
void for_phases(const Services* helpers, const std::array<size_t, kPhases>& counts,
                const Part& part) {
    struct Phase {
        std::atomic<uint32_t> taken{0};  // bits of parts
        std::atomic<size_t> done{0};
    };
    std::array<Phase, kPhases> phases;
    const auto take_part = [&](size_t thread) {
        for (size_t phase = 0; phase < kPhases; ++phase) {
            const size_t count = counts[phase];
            Phase& now = phases[phase];
            for (size_t k = 0; k < count; ++k) {
                const size_t i = (thread + k) % count;
                const uint32_t bit = 1u << i;
                if ((now.taken.fetch_or(bit) & bit) != 0) continue;
                part(phase, i);
                ++now.done;
            }
            if (phase + 1 < kPhases) wait_for([&] { return now.done == count; });
        }
    };
    on_threads(helpers, *std::max_element(counts.begin(), counts.end()), take_part);
}

// How many parts of so many vertices threads share: smaller ones are done before another thread has
// begun.
inline size_t vertex_parts(const Services* helpers, size_t count) {
    constexpr size_t kFewest = 1024;
    return helpers != nullptr ? std::clamp<size_t>(count / kFewest, 1, kMaxVertexThreads) : 1;
}

// Runs of so many vertices, of which the last is shorter, are measured each by one thread. Their
// sums are added in their order, so that it does not matter how many threads there are.
constexpr size_t kVertexRun = 512;
template <class T>
std::span<T> vertex_run(std::span<T> vertices, size_t run) {
    const size_t begin = std::min(vertices.size(), run * kVertexRun);
    return vertices.subspan(begin, std::min(kVertexRun, vertices.size() - begin));
}
inline size_t vertex_runs(size_t vertices) { return (vertices + kVertexRun - 1) / kVertexRun; }

// Calls task(0 .. tasks-1) and run(0 .. runs-1), each once, and returns when all have returned. Who
// has nothing to do takes the next task, so the longest come first. Runs begin when the last task
// has begun. A thread begins with the same ones each time, of whose vertices it may have something
// in its cache, and then takes others' that are left. Neither must throw.
template <class Task, class Run>
void for_tasks_and_runs(const Services* helpers, size_t tasks, const Task& task, size_t runs,
                        const Run& run) {
    std::atomic<size_t> next = 0;
    const size_t threads =
        helpers != nullptr ? std::clamp<size_t>(std::max(tasks, runs), 1, kMaxVertexThreads) : 1;
    const auto runs_of = [threads](size_t thread) { return ArrayPart{thread, threads}; };
    std::array<std::atomic<size_t>, kMaxVertexThreads> taken;  // of each thread's runs
    for (size_t thread = 0; thread < threads; ++thread) taken[thread] = runs_of(thread).begin(runs);
    const auto take_part = [&](size_t thread) {
        for (size_t i = next++; i < tasks; i = next++) task(i);
        for (size_t k = 0; k < threads; ++k) {
            const size_t of = (thread + k) % threads, end = runs_of(of).end(runs);
            for (size_t i = taken[of]++; i < end; i = taken[of]++) run(i);
        }
    };
    on_threads(helpers, threads, take_part);
}

// Tasks alone.
template <class Task>
void for_each_task(const Services* helpers, size_t count, const Task& task) {
    for_tasks_and_runs(helpers, count, task, 0, [](size_t) {});
}

}  // namespace defrec
