// A loop that other threads help with.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <new>

#include "sdk/base/os/services.hpp"

namespace defrec {

// Calls body(0 .. count-1), each once, and returns when all have returned. helpers: whose threads
// take part; null: the caller's alone. Throws std::bad_alloc if a body does; bodies throw nothing
// else.
template <class Body>
void helped_loop(const Services* helpers, size_t count, const Body& body) {
    if (helpers == nullptr) {
        for (size_t i = 0; i < count; ++i) body(i);
        return;
    }
    std::atomic<bool> is_out_of_memory = false;  // loops by helpers do not throw
    helpers->parallel_for(count, [&](size_t i) {
        try {
            body(i);
        } catch (const std::bad_alloc&) {
            is_out_of_memory = true;
        }
    });
    if (is_out_of_memory) throw std::bad_alloc();
}

// The same in runs of so many indices: body(begin, end).
template <class Body>
void helped_runs(const Services* helpers, size_t count, size_t run, const Body& body) {
    helped_loop(helpers, (count + run - 1) / run,
                [&](size_t i) { body(i * run, std::min(count, (i + 1) * run)); });
}

}  // namespace defrec
