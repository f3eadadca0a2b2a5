#include "sdk/base/os/thread_pool.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

using defrec::ThreadPool;

namespace {

struct Counts {
    explicit Counts(size_t count)
        : hits(std::make_unique<std::atomic<int>[]>(count)), size(count) {}
    std::unique_ptr<std::atomic<int>[]> hits;
    size_t size;
    static void body(void* arg, size_t index) { ++static_cast<Counts*>(arg)->hits[index]; }
    bool each_once() const {
        for (size_t i = 0; i < size; ++i)
            if (hits[i] != 1) return false;
        return true;
    }
};

}  // namespace

TEST_CASE("every index is called once, for any number of threads and indices") {
    for (const uint32_t threads : {1u, 2u, 3u, 8u}) {
        ThreadPool pool(threads);
        CHECK(pool.threads() == threads);
        for (const size_t count : {size_t{0}, size_t{1}, size_t{2}, size_t{7}, size_t{1000}}) {
            Counts counts(count);
            pool.parallel_for(count, Counts::body, &counts);
            CHECK(counts.each_once());
        }
    }
}

TEST_CASE(
    "many short loops, one after the other and with pauses in which the threads fall asleep") {
    ThreadPool pool(3);
    for (int i = 0; i < 3000; ++i) {
        Counts counts(5);
        pool.parallel_for(5, Counts::body, &counts);
        REQUIRE(counts.each_once());
        if (i % 300 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

TEST_CASE("a loop with few indices is computed by the caller and the first threads") {
    ThreadPool pool(8);
    struct Seen {
        std::mutex mutex;
        std::set<std::thread::id> threads;
    } seen;
    const auto body = [](void* arg, size_t) {
        auto& self = *static_cast<Seen*>(arg);
        const std::lock_guard lock(self.mutex);
        self.threads.insert(std::this_thread::get_id());
    };
    for (int i = 0; i < 500; ++i) {
        pool.parallel_for(3, body, &seen);
        if (i % 50 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    CHECK(seen.threads.size() <= 3);
    Counts all(100);
    pool.parallel_for(100, Counts::body, &all);
    CHECK(all.each_once());
}

TEST_CASE("threads that were roused, with or without a loop for them, take part in later loops") {
    ThreadPool pool(3);
    for (int i = 0; i < 200; ++i) {
        if (i % 20 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        pool.rouse(i % 4);
        if (i % 3 == 0) continue;
        Counts counts(5);
        pool.parallel_for(5, Counts::body, &counts);
        REQUIRE(counts.each_once());
    }
    ThreadPool(1).rouse(3);
}

TEST_CASE("threads in a loop are awake, and without one they fall asleep") {
    ThreadPool pool(4);
    struct Meeting {
        ThreadPool* pool;
        std::atomic<int> inside{0}, looked{0};
        std::atomic<uint32_t> awake{0};
    } meeting{&pool};
    const auto body = [](void* arg, size_t) {
        auto& self = *static_cast<Meeting*>(arg);
        ++self.inside;
        while (self.inside < 4) std::this_thread::yield();
        self.awake = self.pool->awake();
        ++self.looked;
        while (self.looked < 4) std::this_thread::yield();
    };
    pool.parallel_for(4, body, &meeting);
    CHECK(meeting.awake == 3);
    while (pool.awake() > 0) std::this_thread::yield();
    CHECK(ThreadPool(1).awake() == 0);
}

TEST_CASE("a loop from within a body, and loops from several threads at once, are complete") {
    ThreadPool pool(3);
    struct Nested {
        ThreadPool* pool;
        std::atomic<int> complete{0};
    } nested{&pool, {}};
    const auto body = [](void* arg, size_t) {
        auto& self = *static_cast<Nested*>(arg);
        Counts inner(9);
        self.pool->parallel_for(9, Counts::body, &inner);
        if (inner.each_once()) ++self.complete;
    };
    std::vector<std::thread> callers;
    for (int i = 0; i < 4; ++i)
        callers.emplace_back([&] {
            for (int k = 0; k < 200; ++k) pool.parallel_for(6, body, &nested);
        });
    for (std::thread& caller : callers) caller.join();
    CHECK(nested.complete == 4 * 200 * 6);
}
