// See thread_pool.hpp. Stages run many short loops in a frame, so a thread without work looks for
// some for a little while before it sleeps; sleeping and waking cost more than most gaps between
// two loops.
#include "sdk/base/os/thread_pool.hpp"

#include <algorithm>
#include <chrono>

#include "sdk/base/os/platform.hpp"
#include "sdk/base/os/spin.hpp"
#include "sdk/base/util/array_part.hpp"

namespace defrec {
namespace {

constexpr std::chrono::microseconds kSpin{50};
thread_local bool in_loop = false;

constexpr uint64_t make_share(size_t first, size_t last) { return uint64_t{last} << 32 | first; }

// Takes an index from the front of a share, or from its end; false where it is empty.
template <bool kFront>
bool take(std::atomic<uint64_t>& share, size_t& index) noexcept {
    uint64_t now = share;
    for (;;) {
        const size_t first = now & UINT32_MAX, last = now >> 32;
        if (first >= last) return false;
        index = kFront ? first : last - 1;
        const uint64_t rest = kFront ? make_share(first + 1, last) : make_share(first, last - 1);
        if (share.compare_exchange_weak(now, rest)) return true;
    }
}

}  // namespace

ThreadPool::ThreadPool(uint32_t threads)
    : shares_(std::make_unique<Share[]>(threads)), sleepers_(std::make_unique<Sleeper[]>(threads)) {
    try {
        workers_.reserve(threads - 1);
        for (uint32_t i = 1; i < threads; ++i)
            workers_.push_back(platform::start_thread([this, i] { work(i); }));
    } catch (...) {
        stop();
        throw;
    }
}

ThreadPool::~ThreadPool() { stop(); }

void ThreadPool::stop() noexcept {
    stop_ = true;
    wake(threads(), true);
    for (std::thread& worker : workers_) worker.join();
    workers_.clear();
}

void ThreadPool::share_out(size_t count) noexcept {
    for (size_t i = 0; i < loop_.called; ++i) {
        const ArrayPart part{i, loop_.called};
        shares_[i] = make_share(part.begin(count), part.end(count));
    }
}

// Those of the first so many threads that sleep. rouses: although there is no loop for them.
void ThreadPool::wake(size_t threads, bool rouses) noexcept {
    bool is_locked_once = false;
    for (size_t i = 1; i < std::min<size_t>(threads, this->threads()); ++i) {
        Sleeper& sleeper = sleepers_[i];
        if (!sleeper.is_asleep) continue;
        if (rouses || !is_locked_once) {  // then nobody is between looking and sleeping
            const std::lock_guard lock(mutex_);
            if (rouses) ++sleeper.roused;
            is_locked_once = true;
        }
        sleeper.wake.notify_one();
    }
}

void ThreadPool::take_indices(size_t thread) noexcept {
    in_loop = true;
    const Loop loop = loop_;
    size_t index = 0;
    while (take<true>(shares_[thread], index)) loop.body(loop.arg, index);
    for (size_t i = 1; i < loop.called; ++i)
        while (take<false>(shares_[(thread + i) % loop.called], index)) loop.body(loop.arg, index);
    in_loop = false;
}

void ThreadPool::parallel_for(size_t count, Body body, void* arg) noexcept {
    std::unique_lock caller(caller_, std::defer_lock);
    if (count <= 1 || count > UINT32_MAX || workers_.empty() || in_loop || !caller.try_lock()) {
        for (size_t i = 0; i < count; ++i) body(arg, i);
        return;
    }
    loop_ = {body, arg, std::min<size_t>(count, threads())};
    share_out(count);
    state_ = (state_ / kNumber + 1) * kNumber | loop_.called * kCalled | kOpen;
    wake(loop_.called, false);
    take_indices(0);
    if (((state_ -= kOpen) & kInside) == 0) return;
    const auto all_left = [this] { return (state_ & kInside) == 0; };
    if (spin_until(kSpin, all_left)) return;
    std::unique_lock lock(mutex_);
    state_ |= kCallerSleeps;
    finished_.wait(lock, all_left);
}

void ThreadPool::rouse(size_t threads) noexcept { wake(threads + 1, true); }

uint32_t ThreadPool::awake() const noexcept {
    uint32_t count = 0;
    for (uint32_t i = 1; i < threads(); ++i) count += sleepers_[i].is_asleep ? 0 : 1;
    return count;
}

// False where the loop of that state takes nobody in.
bool ThreadPool::join(uint64_t state) noexcept {
    const uint64_t number = state / kNumber;
    while ((state & kOpen) != 0 && state / kNumber == number)
        if (state_.compare_exchange_weak(state, state + 1)) return true;
    return false;
}

void ThreadPool::leave() noexcept {
    const uint64_t left = --state_;
    if ((left & kInside) != 0 || (left & kCallerSleeps) == 0) return;
    const std::lock_guard lock(mutex_);
    finished_.notify_one();
}

void ThreadPool::work(size_t thread) noexcept {
    uint64_t seen = 0;
    const auto has_news = [&] {
        const uint64_t state = state_;
        return stop_ || (state / kNumber != seen && thread < called(state));
    };
    for (;;) {
        if (!spin_until(kSpin, has_news)) {
            Sleeper& sleeper = sleepers_[thread];
            std::unique_lock lock(mutex_);
            sleeper.is_asleep = true;
            const uint64_t roused = sleeper.roused;
            sleeper.wake.wait(lock, [&] { return sleeper.roused != roused || has_news(); });
            sleeper.is_asleep = false;
            if (!has_news()) continue;
        }
        if (stop_) return;
        const uint64_t state = state_;
        if (thread >= called(state)) continue;
        seen = state / kNumber;
        if (!join(state)) continue;
        take_indices(thread);
        leave();
    }
}

}  // namespace defrec
