// Rows of a picture spread over threads.
#pragma once

#include <algorithm>
#include <functional>
#include <thread>
#include <vector>

namespace defrec::cli {

/// Calls body(first, last) on disjoint ranges that cover 0..rows. body must not throw, and must not
/// let a row's result depend on the range it came in.
inline void parallel_rows(int rows, int threads, const std::function<void(int, int)>& body) {
    const int parts = std::clamp(threads, 1, std::max(rows, 1));
    std::vector<std::thread> pool;
    pool.reserve(static_cast<std::size_t>(parts));
    const auto edge = [&](int part) {
        return static_cast<int>(static_cast<long long>(rows) * part / parts);
    };
    for (int part = 1; part < parts; ++part) {
        pool.emplace_back(body, edge(part), edge(part + 1));
    }
    body(0, edge(1));
    for (std::thread& thread : pool) {
        thread.join();
    }
}

}  // namespace defrec::cli
