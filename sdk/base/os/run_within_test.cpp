#include "sdk/base/os/run_within.hpp"

#include <doctest/doctest.h>

#include <future>
#include <memory>
#include <stdexcept>
#include <thread>

using namespace defrec;
using namespace std::chrono_literals;

TEST_CASE("what ends in time is waited for, on a thread of its own, with all that it owns") {
    auto owned = std::make_shared<std::thread::id>();
    const std::weak_ptr<std::thread::id> left = owned;
    std::thread::id ran;
    CHECK(run_within(1h, [owned = std::move(owned), &ran] { ran = std::this_thread::get_id(); }));
    CHECK(ran != std::thread::id());
    CHECK(ran != std::this_thread::get_id());
    CHECK(left.expired());
}

TEST_CASE("what it throws is thrown to the caller") {
    CHECK_THROWS_AS(run_within(1h, [] { throw std::out_of_range("far"); }), std::out_of_range);
}

TEST_CASE("what does not end in time is left alone, and ends later by itself") {
    std::promise<void> go, gone;
    struct Owned {
        std::promise<void>& gone;
        ~Owned() { gone.set_value(); }
    };
    const bool ended = run_within(5ms, [owned = std::make_shared<Owned>(gone),
                                        may = go.get_future().share()] { may.wait(); });
    CHECK_FALSE(ended);
    go.set_value();
    gone.get_future().wait();
}
