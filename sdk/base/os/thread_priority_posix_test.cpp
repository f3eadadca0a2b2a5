// Which priority the library's threads have, by the thread that starts them.
#include <doctest/doctest.h>
#include <pthread.h>
#include <sys/resource.h>

#include <algorithm>
#include <future>
#include <thread>

#include "sdk/base/os/background_thread.hpp"
#include "sdk/base/os/platform.hpp"

using namespace defrec;

namespace {

int policy_here() {
    int policy = -1;
    sched_param parameters{};
    pthread_getschedparam(pthread_self(), &policy, &parameters);
    return policy;
}

// On a thread with real-time priority; false: this user may have none.
template <class Body>
bool in_real_time(const Body& body) {
    bool may = false;
    std::thread([&] {
        sched_param parameters{};
        parameters.sched_priority = 1;
        may = pthread_setschedparam(pthread_self(), SCHED_RR, &parameters) == 0;
        if (may) body();
    }).join();
    if (!may) MESSAGE("skipped: no right to real-time priority");
    return may;
}

}  // namespace

TEST_CASE("a thread of the library takes over the priority of the thread that starts it") {
    int policy = -1;
    const auto start = [&] { platform::start_thread([&] { policy = policy_here(); }).join(); };
    start();
    CHECK(policy == policy_here());
    if (in_real_time(start)) CHECK(policy == SCHED_RR);
}

TEST_CASE("the thread for work that no frame waits for has a low priority, whoever starts it") {
    struct Seen {
        int policy = -1, nice = -1;
    } seen;
    const auto start = [&] {
        std::promise<Seen> answer;
        BackgroundThread background;
        background.add([&] { answer.set_value({policy_here(), getpriority(PRIO_PROCESS, 0)}); });
        seen = answer.get_future().get();
    };
    const int low = std::max(10, getpriority(PRIO_PROCESS, 0));
    start();
    CHECK(seen.policy == SCHED_OTHER);
    CHECK(seen.nice == low);
    seen = {};
    if (!in_real_time(start)) return;
    CHECK(seen.policy == SCHED_OTHER);
    CHECK(seen.nice == low);
}
