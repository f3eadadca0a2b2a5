#include "sdk/base/os/background_thread.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <future>
#include <memory>
#include <thread>
#include <vector>

using defrec::BackgroundThread;

TEST_CASE(
    "tasks run one after another, in the order in which they were added, on one other thread") {
    std::vector<int> order;
    std::vector<std::thread::id> threads;
    std::promise<void> done;
    BackgroundThread background;
    for (int i = 0; i < 100; ++i)
        background.add([&, i] {
            order.push_back(i);
            threads.push_back(std::this_thread::get_id());
            if (i == 99) done.set_value();
        });
    done.get_future().wait();
    REQUIRE(order.size() == 100);
    for (int i = 0; i < 100; ++i) {
        CHECK(order[static_cast<size_t>(i)] == i);
        CHECK(threads[static_cast<size_t>(i)] == threads[0]);
    }
    CHECK(threads[0] != std::this_thread::get_id());
}

TEST_CASE("a task may add another one, and what a task holds goes when it is done") {
    std::promise<void> done;
    std::weak_ptr<int> held;
    bool was_gone = false;
    BackgroundThread background;
    {
        const auto number = std::make_shared<int>(1);
        held = number;
        background.add([&, number] {
            background.add([&] {
                was_gone = held.expired();
                done.set_value();
            });
        });
    }
    done.get_future().wait();
    CHECK(was_gone);
}

TEST_CASE("the end waits for the task that runs, and drops those that have not begun") {
    std::promise<void> goes_on;
    std::atomic<bool> began{false}, ended{false}, other_began{false};
    const auto number = std::make_shared<int>(1);
    auto background = std::make_unique<BackgroundThread>();
    background->add([&, end = goes_on.get_future().share()] {
        began = true;
        end.wait();
        ended = true;
    });
    background->add([&, number] { other_began = true; });
    while (!began) std::this_thread::yield();
    std::thread last([&] { background.reset(); });
    // The queue is emptied before the end waits for the task.
    while (number.use_count() > 1) std::this_thread::yield();
    CHECK_FALSE(ended);
    goes_on.set_value();
    last.join();
    CHECK(ended);
    CHECK_FALSE(other_began);
}

TEST_CASE("without a task there is no thread to end, and many threads may add tasks") {
    { const BackgroundThread unused; }
    std::atomic<int> done{0};
    std::promise<void> all;
    {
        BackgroundThread background;
        std::vector<std::thread> threads;
        for (int i = 0; i < 4; ++i)
            threads.emplace_back([&] {
                for (int k = 0; k < 50; ++k)
                    background.add([&] {
                        if (++done == 200) all.set_value();
                    });
            });
        for (std::thread& thread : threads) thread.join();
        all.get_future().wait();
    }
    CHECK(done == 200);
}
