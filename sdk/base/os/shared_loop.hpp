// A loop that its caller runs with the help of whoever has nothing else to do: short work, for
// which nobody need be woken.
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <type_traits>

#include "sdk/base/os/spin.hpp"

namespace defrec {

// Outlives those that help.
class SharedLoop {
  public:
    // Calls body(0 .. count-1), each once, here and on the threads that help meanwhile; returns
    // when all have returned. bring() is called when others can help: it may fetch some. One loop
    // at a time; body and bring must not throw.
    template <class Body, class Bring>
    void run(uint32_t count, Body&& body, Bring&& bring) {
        const uint64_t number = (ticket_ >> 32) + 1;
        ticket_ =
            number << 32 | kNone;  // from here on nobody that saw the loop before takes anything
        body_ = [](void* arg, size_t index) {
            (*static_cast<std::remove_reference_t<Body>*>(arg))(index);
        };
        arg_ = const_cast<void*>(static_cast<const void*>(&body));
        count_ = count;
        left_ = count;
        ticket_ = number << 32;
        bring();
        help();
        const auto ended = [this] { return left_ == 0; };
        constexpr std::chrono::microseconds kSpin{100};
        if (spin_until(kSpin, ended)) return;
        std::unique_lock lock(mutex_);
        ended_.wait(lock, ended);
    }

    // Takes a share of the loop that runs, if one does. Any thread, any time.
    void help() {
        uint64_t ticket = ticket_;
        while (static_cast<uint32_t>(ticket) < count_) {
            if (!ticket_.compare_exchange_weak(ticket, ticket + 1)) continue;
            body_(arg_, static_cast<uint32_t>(ticket));
            if (--left_ == 0) {
                const std::lock_guard lock(mutex_);
                ended_.notify_one();
            }
            ticket = ticket_;
        }
    }

  private:
    static constexpr uint64_t kNone = UINT32_MAX;
    std::atomic<uint64_t> ticket_{
        kNone};  // the loop's number, and in the lower half the index that is taken next
    std::atomic<uint32_t> count_{0}, left_{0};         // left_: bodies that have not returned
    void (*body_)(void* arg, size_t index) = nullptr;  // these two as the ticket says
    void* arg_ = nullptr;
    std::mutex mutex_;
    std::condition_variable ended_;
};

}  // namespace defrec
