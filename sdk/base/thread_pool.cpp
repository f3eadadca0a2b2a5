// See thread_pool.hpp. Stages run many short loops in a frame, so a thread without work looks for
// some for a little while before it sleeps; sleeping and waking cost more than most gaps between
// two loops.
#include "sdk/base/thread_pool.hpp"

#include <algorithm>
#include <chrono>

#include "sdk/base/platform.hpp"
#include "sdk/base/spin.hpp"

namespace defrec {
namespace {

constexpr std::chrono::microseconds kSpin{50};
thread_local bool in_loop = false;

}  // namespace

ThreadPool::ThreadPool(uint32_t threads) {
    try {
        workers_.reserve(threads - 1);
        for (uint32_t i = 1; i < threads; ++i)
            workers_.push_back(platform::start_thread([this] { work(); }));
    } catch (...) {
        stop();
        throw;
    }
}

ThreadPool::~ThreadPool() { stop(); }

void ThreadPool::stop() noexcept {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
        ++generation_;
    }
    started_.notify_all();
    for (std::thread& worker : workers_) worker.join();
    workers_.clear();
}

void ThreadPool::take_indices(const Loop& loop) noexcept {
    in_loop = true;
    for (size_t i = next_++; i < loop.count; i = next_++) loop.body(loop.arg, i);
    in_loop = false;
}

void ThreadPool::parallel_for(size_t count, Body body, void* arg) noexcept {
    const Loop loop{body, arg, count};
    std::unique_lock caller(caller_, std::defer_lock);
    if (count <= 1 || workers_.empty() || in_loop || !caller.try_lock()) {
        for (size_t i = 0; i < count; ++i) body(arg, i);
        return;
    }
    uint32_t wake = 0;
    {
        const std::lock_guard lock(mutex_);
        loop_ = loop;
        open_ = true;
        next_ = 0;
        ++generation_;
        wake = static_cast<uint32_t>(std::min<size_t>(sleepers_, count - 1));
    }
    for (; wake > 0; --wake) started_.notify_one();
    take_indices(loop);
    std::unique_lock lock(mutex_);
    open_ = false;
    if (active_ == 0) return;
    lock.unlock();
    if (spin_until(kSpin, [this] { return active_ == 0; })) return;
    lock.lock();
    finished_.wait(lock, [this] { return active_ == 0; });
}

void ThreadPool::work() noexcept {
    uint64_t seen = 0;
    for (;;) {
        spin_until(kSpin, [&] { return generation_ != seen; });
        Loop loop;
        {
            std::unique_lock lock(mutex_);
            ++sleepers_;
            started_.wait(lock, [&] { return generation_ != seen; });
            --sleepers_;
            seen = generation_;
            if (stop_) return;
            if (!open_) continue;
            loop = loop_;
            ++active_;
        }
        take_indices(loop);
        const std::lock_guard lock(mutex_);
        if (--active_ == 0) finished_.notify_one();
    }
}

}  // namespace defrec
