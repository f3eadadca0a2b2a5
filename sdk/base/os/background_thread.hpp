// A thread for work that nobody waits for: it has a low priority and does one task after another.
#pragma once
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace defrec {

// Any thread. The thread starts with the first task.
class BackgroundThread {
  public:
    BackgroundThread() = default;
    // Waits for the task that runs; those that have not begun are dropped.
    ~BackgroundThread();
    BackgroundThread(const BackgroundThread&) = delete;
    BackgroundThread& operator=(const BackgroundThread&) = delete;

    // task must not throw. Throws std::bad_alloc, Error(DEFREC_ERROR_OUT_OF_MEMORY).
    void add(std::function<void()> task);

  private:
    void work() noexcept;

    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::function<void()>> tasks_;
    bool ends_ = false;
    std::thread thread_;
};

}  // namespace defrec
