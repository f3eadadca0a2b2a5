// A thread for a task that its owner begins again and again, and waits for later.
#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
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
    // Returns when the task that was begun has ended, or none was. One that the thread has not come
    // to is done here.
    void wait() noexcept;

  private:
    void work() noexcept;
    bool take() noexcept;

    const std::function<void()> task_;
    std::mutex mutex_;
    std::condition_variable changed_;
    enum class Task : uint8_t { kNone, kBegun, kTaken };
    std::atomic<Task> state_{Task::kNone};  // begun by the owner, ended by the thread, under mutex_
    bool ends_ = false;                     // under mutex_
    std::thread thread_;                    // starts with the first task
};

}  // namespace defrec
