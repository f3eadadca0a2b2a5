// Whether a thread that calls a device's functions has got stuck in one. The thread tells when it
// enters and leaves; whoever waits for it looks.
#pragma once
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace defrec {

// Any thread.
class DeviceWatch {
  public:
    using Clock = std::chrono::steady_clock;

    // limit: for one call.
    explicit DeviceWatch(std::chrono::milliseconds limit) : limit_(limit) {}

    // Before the first call; those of other threads do not count.
    void watch_this_thread() noexcept { thread_ = std::this_thread::get_id(); }
    // name: of the call, static storage.
    void enter(const char* name) noexcept {
        if (std::this_thread::get_id() != thread_) return;
        name_ = name;
        entered_ns_ = Clock::now().time_since_epoch().count();
    }
    void leave() noexcept {
        if (std::this_thread::get_id() == thread_) entered_ns_ = 0;
    }

    // The call that has been under way for longer than the limit, of it the last eighth since
    // somebody first looked; nullptr: none. Where the whole process was stopped for as long, the
    // call has that eighth to end in.
    const char* stuck_in() const noexcept {
        const int64_t entered = entered_ns_;
        const Clock::time_point now = Clock::now();
        if (entered == 0 || now < late_from(entered)) return nullptr;
        const std::lock_guard lock(mutex_);
        if (late_call_ns_ != entered) {
            late_call_ns_ = entered;
            seen_late_ = now;
        }
        return now > stuck_from(entered) ? name_.load() : nullptr;
    }

    enum class Outcome { kDone, kTimeout, kStuck };
    // Waits on changed, under lock, until done() holds, the time end, or the thread is stuck.
    template <class Done>
    Outcome wait_until(std::condition_variable& changed, std::unique_lock<std::mutex>& lock,
                       Clock::time_point end, Done&& done) const {
        for (;;) {
            if (done()) return Outcome::kDone;
            if (stuck_in() != nullptr) return Outcome::kStuck;
            const Clock::time_point now = Clock::now();
            if (now >= end) return Outcome::kTimeout;
            changed.wait_until(lock, std::min(end, next_look(now) + std::chrono::milliseconds(1)));
        }
    }

  private:
    static Clock::time_point time_of(int64_t ns) noexcept {
        return Clock::time_point(Clock::duration(ns));
    }
    Clock::time_point late_from(int64_t entered) const noexcept {
        return time_of(entered) + limit_ - limit_ / 8;
    }
    // For a call that was seen late; under the mutex.
    Clock::time_point stuck_from(int64_t entered) const noexcept {
        return std::max(time_of(entered) + limit_, seen_late_ + limit_ / 8);
    }
    // No sooner than anything can be late, or stuck.
    Clock::time_point next_look(Clock::time_point now) const noexcept {
        const int64_t entered = entered_ns_;
        if (entered == 0) return now + limit_ - limit_ / 8;
        const std::lock_guard lock(mutex_);
        return late_call_ns_ == entered ? stuck_from(entered) : late_from(entered);
    }

    const std::chrono::microseconds limit_;
    std::thread::id thread_;
    std::atomic<const char*> name_{""};
    std::atomic<int64_t> entered_ns_{0};  // 0: in none
    mutable std::mutex mutex_;
    mutable int64_t late_call_ns_ = 0;  // when the call began that was last seen late
    mutable Clock::time_point seen_late_;
};

}  // namespace defrec
