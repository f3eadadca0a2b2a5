// Loops over vertices in which the context's threads take part.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <span>

#include "sdk/base/services.hpp"

namespace defrec {

constexpr size_t kMaxVertexThreads = 8;  // each that is woken costs the caller a system call

// Calls body(begin, end) for runs that together are 0 .. count, and returns when all have returned.
// helpers: whose threads take part; nullptr: none. The body must not throw.
template <class Body>
void for_runs(const Services* helpers, size_t count, const Body& body) {
    constexpr size_t kShortest = 1024;  // less is done before another thread has begun
    const size_t runs =
        helpers != nullptr ? std::clamp<size_t>(count / kShortest, 1, kMaxVertexThreads) : 1;
    if (helpers == nullptr || runs == 1) {
        body(size_t{0}, count);
        return;
    }
    helpers->parallel_for(runs,
                          [&](size_t run) { body(count * run / runs, count * (run + 1) / runs); });
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
// has begun, and a thread takes the same ones each time, of whose vertices it may have something in
// its cache. Neither must throw.
template <class Task, class Run>
void for_tasks_and_runs(const Services* helpers, size_t tasks, const Task& task, size_t runs,
                        const Run& run) {
    std::atomic<size_t> next = 0;
    const size_t threads =
        helpers != nullptr ? std::clamp<size_t>(std::max(tasks, runs), 1, kMaxVertexThreads) : 1;
    const auto take_part = [&](size_t thread) {
        for (size_t i = next++; i < tasks; i = next++) task(i);
        for (size_t i = runs * thread / threads; i < runs * (thread + 1) / threads; ++i) run(i);
    };
    if (helpers != nullptr)
        helpers->parallel_for(threads, take_part);
    else
        take_part(0);
}

// Tasks alone.
template <class Task>
void for_each_task(const Services* helpers, size_t count, const Task& task) {
    for_tasks_and_runs(helpers, count, task, 0, [](size_t) {});
}

}  // namespace defrec
