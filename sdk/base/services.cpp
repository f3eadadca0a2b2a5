// See services.hpp. Nothing that an application's callback throws gets past this file.
#include "sdk/base/services.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <thread>
#include <utility>

#include "sdk/base/callback.hpp"
#include "sdk/base/error.hpp"
#include "sdk/base/platform.hpp"
#include "sdk/contract/descs.hpp"

namespace defrec {
namespace {

thread_local bool parallel_failure = false;

// A loop handed to the application; counts what was done of it.
struct LentLoop {
    void (*body)(void* arg, size_t index);
    void* arg;
    size_t count;
    std::atomic<size_t> done{0};

    static void run(void* self, size_t index) {
        auto& loop = *static_cast<LentLoop*>(self);
        if (index >= loop.count) return;
        const platform::DefaultFloatingPoint mode;
        loop.body(loop.arg, index);
        ++loop.done;
    }
};

}  // namespace

Services::Services(const defrec_context_desc& desc) : desc_(desc) {
    if ((desc.alloc == nullptr) != (desc.free == nullptr))
        fail(DEFREC_ERROR_ARGUMENT, "alloc and free must both be given or both be NULL");
    fill_defaults(desc_);
    // Plugin paths belong to the application and are not used after the search.
    desc_.plugin_paths = nullptr;
    desc_.plugin_path_count = 0;
    const uint32_t cores =
        std::clamp(std::thread::hardware_concurrency(), 1u, uint32_t{kContextMaxThreads});
    if (desc_.threads == 0) desc_.threads = cores;
    if (desc_.parallel_for == nullptr) pool_ = std::make_unique<ThreadPool>(desc_.threads);
}

void Services::log(int32_t level, const char* source, const char* text) const noexcept {
    if (desc_.log == nullptr || level < desc_.log_level) return;
    const CallbackScope scope;
    try {
        desc_.log(desc_.log_user, level, source, text);
    } catch (...) {
    }
}

void* Services::allocate(size_t size, size_t alignment) const noexcept {
    if (desc_.alloc != nullptr) {
        const CallbackScope scope;
        try {
            return desc_.alloc(desc_.alloc_user, size, alignment);
        } catch (...) {
            return nullptr;
        }
    }
    alignment = std::max(alignment, sizeof(void*));
    if (size > SIZE_MAX - alignment) return nullptr;
    return std::aligned_alloc(alignment,
                              (std::max<size_t>(size, 1) + alignment - 1) / alignment * alignment);
}

void Services::release(void* memory) const noexcept {
    if (memory == nullptr) return;
    if (desc_.free == nullptr) return std::free(memory);
    const CallbackScope scope;
    try {
        desc_.free(desc_.alloc_user, memory);
    } catch (...) {
    }
}

void Services::parallel_for_raw(size_t count, void (*body)(void* arg, size_t index),
                                void* arg) const noexcept {
    if (pool_ != nullptr) return pool_->parallel_for(count, body, arg);
    LentLoop loop{body, arg, count, {}};
    const CallbackScope scope;
    try {
        desc_.parallel_for(desc_.parallel_for_user, count, LentLoop::run, &loop);
    } catch (...) {
        parallel_failure = true;
    }
    if (loop.done != count) parallel_failure = true;
}

uint32_t Services::concurrency() const noexcept { return desc_.threads; }

void Services::forget_parallel_failure() noexcept { parallel_failure = false; }

void Services::expect_parallel_success(const char* what) {
    if (std::exchange(parallel_failure, false))
        fail(DEFREC_ERROR_STATE, what,
             ": the application's parallel_for did not call every body once");
}

}  // namespace defrec
