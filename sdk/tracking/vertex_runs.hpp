// Loops over vertices in which the context's threads take part.
#pragma once
#include <algorithm>
#include <cstddef>

#include "sdk/base/services.hpp"

namespace defrec {

// Calls body(begin, end) for runs that together are 0 .. count, and returns when all have returned.
// helpers: whose threads take part; nullptr: none. The body must not throw.
template <class Body>
void for_runs(const Services* helpers, size_t count, const Body& body) {
    constexpr size_t kMost = 4;         // each thread that is woken costs the caller a system call
    constexpr size_t kShortest = 1024;  // less is done before another thread has begun
    const size_t runs = helpers != nullptr ? std::clamp<size_t>(count / kShortest, 1, kMost) : 1;
    if (runs == 1) {
        body(size_t{0}, count);
        return;
    }
    helpers->parallel_for(runs,
                          [&](size_t run) { body(count * run / runs, count * (run + 1) / runs); });
}

// Calls task(0 .. count-1), each once, and returns when all have returned. It must not throw.
template <class Task>
void for_each_task(const Services* helpers, size_t count, const Task& task) {
    if (helpers != nullptr) {
        helpers->parallel_for(count, task);
        return;
    }
    for (size_t i = 0; i < count; ++i) task(i);
}

}  // namespace defrec
