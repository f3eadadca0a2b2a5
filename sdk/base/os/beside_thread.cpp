// See beside_thread.hpp.
#include "sdk/base/os/beside_thread.hpp"

#include <chrono>
#include <exception>

#include "sdk/base/os/platform.hpp"
#include "sdk/base/os/spin.hpp"

namespace defrec {

BesideThread::~BesideThread() {
    wait();
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void BesideThread::begin() noexcept {
    wait();
    if (!thread_.joinable()) try {
            thread_ = platform::start_thread([this] { work(); });
        } catch (const std::exception&) {
            return task_();
        }
    {
        const std::lock_guard lock(mutex_);
        state_ = Task::kBegun;
    }
    changed_.notify_all();
}

// true: the task is the caller's to do.
bool BesideThread::take() noexcept {
    Task begun = Task::kBegun;
    return state_.compare_exchange_strong(begun, Task::kTaken);
}

void BesideThread::wait() noexcept {
    if (take()) {
        task_();
        state_ = Task::kNone;
        return;
    }
    constexpr std::chrono::microseconds kSpin{200};  // an owner that waits is nearly always early
    const auto has_ended = [this] { return state_ == Task::kNone; };
    if (spin_until(kSpin, has_ended)) return;
    std::unique_lock lock(mutex_);
    changed_.wait(lock, has_ended);
}

void BesideThread::work() noexcept {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return ends_ || state_ == Task::kBegun; });
        if (ends_) return;
        lock.unlock();
        const bool is_taken = take();
        if (is_taken) task_();
        lock.lock();
        if (!is_taken) continue;
        state_ = Task::kNone;
        changed_.notify_all();
    }
}

}  // namespace defrec
