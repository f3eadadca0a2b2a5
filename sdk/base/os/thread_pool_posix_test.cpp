#include <doctest/doctest.h>
#include <pthread.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "sdk/base/os/thread_pool.hpp"

using defrec::ThreadPool;

TEST_CASE("row 31: the pool's threads take none of the application's signals") {
    ThreadPool pool(2);
    struct Seen {
        std::thread::id caller = std::this_thread::get_id();
        std::atomic<int> others{0}, blocked{0}, faults_blocked{0}, go{0};
    } seen;
    const auto body = [](void* arg, size_t) {
        auto& self = *static_cast<Seen*>(arg);
        // Both threads stay until both are here.
        for (++self.go; self.go < 2;) std::this_thread::yield();
        if (std::this_thread::get_id() == self.caller) return;
        sigset_t mask;
        pthread_sigmask(SIG_SETMASK, nullptr, &mask);
        ++self.others;
        if (sigismember(&mask, SIGINT) == 1 && sigismember(&mask, SIGUSR1) == 1) ++self.blocked;
        for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL})
            self.faults_blocked += sigismember(&mask, fault);
    };
    pool.parallel_for(2, body, &seen);
    CHECK(seen.others == 1);
    CHECK(seen.blocked == 1);
    CHECK(seen.faults_blocked == 0);  // else the process ends without the application's handler
}
