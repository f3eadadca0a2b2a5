#include "sdk/base/os/beside_thread.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <thread>

using defrec::BesideThread;

TEST_CASE("each task that is begun has been done once when it was waited for") {
    int count = 0;
    BesideThread beside([&] { ++count; });
    beside.wait();
    CHECK(count == 0);
    for (int i = 1; i <= 1000; ++i) {
        beside.begin();
        beside.wait();
        beside.wait();
        CHECK(count == i);
    }
}

TEST_CASE("a task is done by one other thread, unless that is waited for before") {
    std::atomic<bool> has_begun{false};
    std::thread::id thread, first;
    BesideThread beside([&] {
        thread = std::this_thread::get_id();
        has_begun = true;
    });
    for (int i = 0; i < 20; ++i) {
        has_begun = false;
        beside.begin();
        while (!has_begun) std::this_thread::yield();
        beside.wait();
        if (i == 0) first = thread;
        CHECK(thread == first);
    }
    CHECK(first != std::this_thread::get_id());
}

TEST_CASE("the owner does a task that the thread has not come to") {
    const std::thread::id owner = std::this_thread::get_id();
    bool is_mine = false;
    // A thread takes a while to start.
    for (int i = 0; i < 1000 && !is_mine; ++i) {
        BesideThread beside([&] { is_mine = std::this_thread::get_id() == owner; });
        beside.begin();
        beside.wait();
    }
    CHECK(is_mine);
}

TEST_CASE("the owner goes on beside a task, and waits for one that takes long") {
    std::promise<void> goes_on;
    const std::shared_future<void> end = goes_on.get_future().share();
    std::atomic<bool> has_begun{false}, has_ended{false};
    BesideThread beside([&] {
        has_begun = true;
        end.wait();
        has_ended = true;
    });
    beside.begin();
    while (!has_begun) std::this_thread::yield();
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
