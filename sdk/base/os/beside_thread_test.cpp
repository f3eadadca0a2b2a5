#include "sdk/base/os/beside_thread.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <thread>

using defrec::BesideThread;

TEST_CASE("each task that is begun has ended when it was waited for, on one other thread") {
    int count = 0;
    std::thread::id thread, first;
    BesideThread beside([&] {
        ++count;
        thread = std::this_thread::get_id();
    });
    beside.wait();
    CHECK(count == 0);
    for (int i = 1; i <= 100; ++i) {
        beside.begin();
        beside.wait();
        CHECK(count == i);
        if (i == 1) first = thread;
        CHECK(thread == first);
    }
    CHECK(first != std::this_thread::get_id());
}

TEST_CASE("the owner goes on beside a task, and waits for one that takes long") {
    std::promise<void> goes_on;
    const std::shared_future<void> end = goes_on.get_future().share();
    std::atomic<bool> has_ended{false};
    BesideThread beside([&] {
        end.wait();
        has_ended = true;
    });
    beside.begin();
    CHECK(!has_ended);
    std::thread later([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        goes_on.set_value();
    });
    beside.wait();
    CHECK(has_ended);
    later.join();
}

TEST_CASE("a task that is begun waits for the one before, and the thread's end for both") {
    std::atomic<int> running{0}, most{0}, count{0};
    {
        BesideThread beside([&] {
            most = std::max(most.load(), ++running);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            --running;
            ++count;
        });
        for (int i = 0; i < 20; ++i) beside.begin();
    }
    CHECK(count == 20);
    CHECK(most == 1);
}
