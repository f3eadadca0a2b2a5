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
        is_busy_ = true;
    }
    changed_.notify_all();
}

void BesideThread::wait() const noexcept {
    constexpr std::chrono::microseconds kSpin{200};  // an owner that waits is nearly always early
    const auto has_ended = [this] { return !is_busy_; };
    if (has_ended() || spin_until(kSpin, has_ended)) return;
    std::unique_lock lock(mutex_);
    changed_.wait(lock, has_ended);
}

void BesideThread::work() noexcept {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return ends_ || is_busy_; });
        if (ends_) return;
        lock.unlock();
        task_();
        lock.lock();
        is_busy_ = false;
        changed_.notify_all();
    }
}

}  // namespace defrec
