// See run_within.hpp.
#include "sdk/base/os/run_within.hpp"

#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include "sdk/base/os/platform.hpp"

namespace defrec {
namespace {

struct Call {
    std::function<void()> body;
    std::mutex mutex;
    std::condition_variable changed;
    bool has_ended = false;
    std::exception_ptr failure;

    void run() noexcept {
        std::exception_ptr thrown;
        try {
            body();
        } catch (...) {
            thrown = std::current_exception();
        }
        body = nullptr;
        const std::lock_guard lock(mutex);
        failure = std::move(thrown);
        has_ended = true;
        changed.notify_all();
    }
};

}  // namespace

void stay_if_thread_ends() noexcept {
    // No exception, but an unwinding that was forced.
    if (std::current_exception() != nullptr) return;
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

bool run_within(std::chrono::milliseconds limit, std::function<void()> body) {
    const auto call = std::make_shared<Call>();
    call->body = std::move(body);
    std::thread thread = platform::start_thread([call] { call->run(); });
    std::unique_lock lock(call->mutex);
    const auto end = std::chrono::steady_clock::now() + limit;
    if (!call->changed.wait_until(lock, end, [&] { return call->has_ended; })) {
        thread.detach();
        return false;
    }
    lock.unlock();
    thread.join();
    if (call->failure) std::rethrow_exception(call->failure);
    return true;
}

}  // namespace defrec
