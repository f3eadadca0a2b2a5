// The library's own threads: one parallel loop at a time, the caller takes part.
#pragma once
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace defrec {

class ThreadPool {
  public:
    using Body = void (*)(void* arg, size_t index);

    // threads: of a parallel loop, the caller's included, at least 1. Throws Error(OUT_OF_MEMORY)
    // if one cannot be started.
    explicit ThreadPool(uint32_t threads);
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    // Calls body(arg, 0 .. count-1), each once, and returns when all have returned. Any thread;
    // while another thread's loop runs, and from within a body, the whole loop runs on the calling
    // thread.
    void parallel_for(size_t count, Body body, void* arg) noexcept;
    uint32_t threads() const { return static_cast<uint32_t>(workers_.size()) + 1; }

  private:
    struct Loop {
        Body body = nullptr;
        void* arg = nullptr;
        size_t count = 0;
    };
    void work() noexcept;
    void stop() noexcept;
    bool join(uint64_t state) noexcept;
    void leave() noexcept;
    void take_indices() noexcept;

    // state_: the number of the loop, whether threads may join it, whether its caller sleeps until
    // they have left, and how many are inside. Loop and next_ change while none is.
    static constexpr uint64_t kInside = (uint64_t{1} << 16) - 1, kCallerSleeps = uint64_t{1} << 16,
                              kOpen = uint64_t{1} << 17, kNumber = uint64_t{1} << 18;

    std::mutex caller_;  // held by the thread whose loop runs
    std::mutex mutex_;   // of those who sleep
    std::condition_variable started_, finished_;
    alignas(64) std::atomic<uint64_t> state_{0};
    std::atomic<uint32_t> sleepers_{0};
    std::atomic<bool> stop_{false};
    alignas(64) std::atomic<size_t> next_{0};
    alignas(64) Loop loop_;
    std::vector<std::thread> workers_;
};

}  // namespace defrec
