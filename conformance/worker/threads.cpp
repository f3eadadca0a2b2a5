// See threads.hpp.
#include "conformance/worker/threads.hpp"

#include <chrono>
#include <exception>
#include <thread>
#include <vector>

#include "conformance/worker/system.hpp"

namespace defrec::conformance {

void on_threads(size_t count, const std::function<void(size_t)>& body) {
    std::vector<std::exception_ptr> failures(count);
    std::vector<std::thread> threads;
    for (size_t i = 0; i < count; ++i)
        threads.emplace_back([&, i] {
            try {
                body(i);
            } catch (...) {
                failures[i] = std::current_exception();
            }
        });
    for (std::thread& thread : threads) thread.join();
    for (const std::exception_ptr& failure : failures)
        if (failure != nullptr) std::rethrow_exception(failure);
}

size_t threads_beyond(size_t known) {
    size_t count = thread_count();
    for (int i = 0; i < 200 && count > known; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        count = thread_count();
    }
    return count > known ? count - known : 0;
}

}  // namespace defrec::conformance
