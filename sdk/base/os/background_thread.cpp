// See background_thread.hpp.
#include "sdk/base/os/background_thread.hpp"

#include <utility>

#include "sdk/base/os/platform.hpp"

namespace defrec {

BackgroundThread::~BackgroundThread() {
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
        tasks_.clear();
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void BackgroundThread::add(std::function<void()> task) {
    const std::lock_guard lock(mutex_);
    if (!thread_.joinable())
        thread_ = platform::start_thread([this] {
            platform::lower_priority();
            work();
        });
    tasks_.push_back(std::move(task));
    changed_.notify_all();
}

void BackgroundThread::work() noexcept {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return ends_ || !tasks_.empty(); });
        if (ends_) return;
        std::function<void()> task = std::move(tasks_.front());
        tasks_.pop_front();
        lock.unlock();
        task();
        task = nullptr;  // what it holds may take a while to go
        lock.lock();
    }
}

}  // namespace defrec
