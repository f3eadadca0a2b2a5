// The library's own threads: one parallel loop at a time, the caller takes part. Loops with as many
// indices give a thread the same ones each time, so that what it computed in one loop is in its
// cache in the next; who has done its own takes from others. A loop with few indices calls the
// first threads alone, and the others sleep on: cores are left to other programs.
#pragma once
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
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
    // Lets the first so many threads look for a loop for a little while, if they sleep: one that is
    // about to begin finds them awake. Any thread.
    void rouse(size_t threads) noexcept;
    // Threads besides the caller's that do not sleep. Any thread.
    uint32_t awake() const noexcept;
    uint32_t threads() const { return static_cast<uint32_t>(workers_.size()) + 1; }

  private:
    struct Loop {
        Body body = nullptr;
        void* arg = nullptr;
        size_t called = 0;  // threads, the caller's included
    };
    struct Sleeper {
        std::condition_variable wake;
        std::atomic<bool> is_asleep{false};
        uint64_t roused = 0;  // how often, under the mutex
    };
    // Indices [first, last) that nobody has taken yet: last << 32 | first.
    using Share = std::atomic<uint64_t>;
    void work(size_t thread) noexcept;
    void stop() noexcept;
    bool join(uint64_t state) noexcept;
    void leave() noexcept;
    void share_out(size_t count) noexcept;
    void wake(size_t threads, bool rouses) noexcept;
    void take_indices(size_t thread) noexcept;

    // state_: the number of the loop, how many threads it calls, whether they may join it, whether
    // its caller sleeps until they have left, and how many are inside. Loop and shares change while
    // none is.
    static constexpr uint64_t kInside = (uint64_t{1} << 16) - 1, kCallerSleeps = uint64_t{1} << 16,
                              kOpen = uint64_t{1} << 17, kCalled = uint64_t{1} << 18,
                              kNumber = uint64_t{1} << 34;
    static size_t called(uint64_t state) { return state % kNumber / kCalled; }

    std::mutex caller_;  // held by the thread whose loop runs
    std::mutex mutex_;   // of those who sleep
    std::condition_variable finished_;
    alignas(64) std::atomic<uint64_t> state_{0};
    std::atomic<bool> stop_{false};
    alignas(64) Loop loop_;
    std::unique_ptr<Share[]> shares_;      // of each thread; the caller's is the first
    std::unique_ptr<Sleeper[]> sleepers_;  // likewise
    std::vector<std::thread> workers_;
};

}  // namespace defrec
