// Looking for a little while instead of sleeping: being woken takes 30 to 60 microseconds.
#pragma once
#include <chrono>
#include <thread>

#include "sdk/base/os/platform.hpp"

namespace defrec {

// Whether condition came true within the time.
template <class Condition>
bool spin_until(std::chrono::nanoseconds time, Condition condition) {
    const auto end = std::chrono::steady_clock::now() + time;
    do {
        for (int i = 0; i < 32; ++i) {
            if (condition()) return true;
            platform::spin_pause();
        }
        std::this_thread::yield();
    } while (std::chrono::steady_clock::now() < end);
    return false;
}

}  // namespace defrec
