// A thread for a task that its owner begins again and again, and waits for later.
#pragma once
#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace defrec {

// One thread, the owner's.
class BesideThread {
  public:
    // task must not throw.
    explicit BesideThread(std::function<void()> task) : task_(std::move(task)) {}
    // Waits for the task.
    ~BesideThread();
    BesideThread(const BesideThread&) = delete;
    BesideThread& operator=(const BesideThread&) = delete;

    // Waits for the task that was begun before. Where no thread can be started it is done at once.
    void begin() noexcept;
    // Returns when the task that was begun has ended, or none was.
    void wait() const noexcept;

  private:
    void work() noexcept;

    const std::function<void()> task_;
    mutable std::mutex mutex_;
    mutable std::condition_variable changed_;
    std::atomic<bool> is_busy_{false};  // set and read by the owner, cleared under the mutex
    bool ends_ = false;                 // under the mutex
    std::thread thread_;                // starts with the first task
};

}  // namespace defrec
