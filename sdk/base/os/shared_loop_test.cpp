// A shared loop: every index once, whoever helps and whenever.
#include "sdk/base/os/shared_loop.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

using defrec::SharedLoop;

TEST_CASE("a loop that nobody helps runs on its caller; one of nothing ends") {
    SharedLoop loop;
    std::vector<int> times(100);
    loop.run(
        static_cast<uint32_t>(times.size()), [&](size_t i) { ++times[i]; }, [] {});
    CHECK(std::count(times.begin(), times.end(), 1) == 100);
    loop.run(
        0, [&](size_t) { times[0] = -1; }, [&] { loop.help(); });
    CHECK(times[0] == 1);
}

TEST_CASE("a helper takes its share, and the loop does not end before it has") {
    SharedLoop loop;
    std::atomic<bool> helping{false}, may_end{false}, helped{false};
    std::thread helper;
    const auto caller = std::this_thread::get_id();
    loop.run(
        2,
        [&](size_t) {
            if (std::this_thread::get_id() == caller) {
                may_end = true;
            } else {
                helping = true;
                while (!may_end) std::this_thread::yield();
                std::this_thread::sleep_for(
                    std::chrono::milliseconds(2));  // longer than the caller looks
                helped = true;
            }
        },
        [&] {
            helper = std::thread([&] { loop.help(); });
            while (!helping) std::this_thread::yield();
        });
    CHECK(helped);
    helper.join();
}

TEST_CASE("helpers that come and go do every index of every loop once") {
    SharedLoop loop;
    std::atomic<bool> stop{false};
    std::vector<std::thread> helpers;
    for (int i = 0; i < 3; ++i)
        helpers.emplace_back([&] {
            while (!stop) loop.help();
        });
    size_t wrong = 0;
    for (size_t round = 0; round < 3000; ++round) {
        std::vector<int> times(round % 17);
        loop.run(
            static_cast<uint32_t>(times.size()), [&](size_t i) { ++times[i]; }, [] {});
        wrong += times.size() - static_cast<size_t>(std::count(times.begin(), times.end(), 1));
    }
    stop = true;
    for (std::thread& helper : helpers) helper.join();
    CHECK(wrong == 0);
}
