// The host that tests of stages run under: plain allocation, and parallel_for over a few threads in
// a scattered order.
#pragma once
#include <atomic>
#include <thread>
#include <vector>

#include "backends/shared/stage.hpp"
#include "sdk/base/os/aligned_memory.hpp"

namespace defrec::test {

// threads: how many parallel_for uses and concurrency answers.
class TestHost {
  public:
    explicit TestHost(uint32_t threads = 2) : threads_(threads) {
        table_.struct_size = sizeof table_;
        table_.self = this;
        table_.log = [](void*, int32_t, const char*) {};
        table_.error = [](void*, const char*) {};
        table_.alloc = [](void*, size_t size, size_t alignment) -> void* {
            return allocate_aligned(size, alignment);
        };
        table_.free = [](void*, void* memory) { free_aligned(memory); };
        table_.parallel_for = [](void* self, size_t count, void (*body)(void*, size_t), void* arg) {
            static_cast<TestHost*>(self)->parallel_for(count, body, arg);
        };
        table_.concurrency = [](void* self) { return static_cast<TestHost*>(self)->threads_; };
    }
    TestHost(const TestHost&) = delete;
    TestHost& operator=(const TestHost&) = delete;

    Host host() const { return Host(&table_); }

  private:
    void parallel_for(size_t count, void (*body)(void*, size_t), void* arg) const {
        std::atomic<size_t> next{0};
        auto work = [&] {
            for (size_t i = next++; i < count; i = next++) body(arg, count - 1 - i);
        };
        std::vector<std::thread> others;
        for (uint32_t i = 1; i < threads_; ++i) others.emplace_back(work);
        work();
        for (std::thread& thread : others) thread.join();
    }

    defrec_host table_{};
    uint32_t threads_;
};

}  // namespace defrec::test
