// See services.hpp. Nothing that an application's callback throws gets past this file.
#include "sdk/base/os/services.hpp"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "sdk/base/os/aligned_memory.hpp"
#include "sdk/base/os/callback.hpp"
#include "sdk/base/os/platform.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/contract/descs.hpp"

namespace defrec {
namespace {

thread_local bool parallel_failure = false;

// A loop handed to the application, which may call its bodies twice, too late or not at all: each
// index is run once while the loop is open, and every other call does nothing. Loops are used again
// and never freed, so that a call that comes too late finds one.
class LentLoop {
  public:
    static LentLoop* take() {
        const std::lock_guard lock(mutex());
        if (free_ == nullptr) return new LentLoop;
        return std::exchange(free_, free_->next_);
    }

    void open(size_t count, void (*body)(void* arg, size_t index), void* arg) {
        body_ = body;
        arg_ = arg;
        count_ = count;
        done_ = 0;
        const size_t words = (count + kBits - 1) / kBits;
        if (claimed_.size() < words) claimed_ = std::vector<std::atomic<uint64_t>>(words);
        for (size_t i = 0; i < words; ++i) claimed_[i] = 0;
        open_ = true;
    }
    // Waits for the bodies that run. Whether each has.
    bool close() {
        open_ = false;
        while (inside_ != 0) std::this_thread::yield();
        const bool complete = done_ == count_;
        const std::lock_guard lock(mutex());
        next_ = std::exchange(free_, this);
        return complete;
    }

    static void run(void* self, size_t index) {
        auto& loop = *static_cast<LentLoop*>(self);
        ++loop.inside_;
        if (loop.open_ && index < loop.count_ && loop.claim(index)) {
            const platform::DefaultFloatingPoint mode;
            loop.body_(loop.arg_, index);
            ++loop.done_;
        }
        --loop.inside_;
    }

  private:
    static constexpr size_t kBits = 64;
    static std::mutex& mutex() {
        static auto& value = *new std::mutex;  // outlives static destructors
        return value;
    }
    bool claim(size_t index) {
        const uint64_t bit = uint64_t{1} << index % kBits;
        return (claimed_[index / kBits].fetch_or(bit) & bit) == 0;
    }

    static inline LentLoop* free_ = nullptr;  // under the mutex
    LentLoop* next_ = nullptr;
    void (*body_)(void* arg, size_t index) = nullptr;
    void* arg_ = nullptr;
    size_t count_ = 0;
    std::vector<std::atomic<uint64_t>> claimed_;  // a bit for each index
    std::atomic<bool> open_{false};
    std::atomic<size_t> inside_{0}, done_{0};
};

// Closes a loop, whatever the application's parallel_for throws.
struct Closing {
    LentLoop& loop;
    ~Closing() {
        if (!loop.close()) parallel_failure = true;
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
    if (desc_.log == nullptr || level < desc_.log_level || ended_) return;
    const CallbackScope scope;
    try {
        desc_.log(desc_.log_user, level, source, text);
    } catch (...) {
    }
}

void* Services::allocate(size_t size, size_t alignment) const noexcept {
    if (desc_.alloc != nullptr) {
        if (ended_) return nullptr;
        void* memory = nullptr;
        {
            const CallbackScope scope;
            try {
                memory = desc_.alloc(desc_.alloc_user, size, alignment);
            } catch (...) {
                return nullptr;
            }
        }
        if (reinterpret_cast<uintptr_t>(memory) % alignment == 0) return memory;
        release(memory);
        log(DEFREC_LOG_ERROR, "sdk",
            "the application's alloc gave memory that does not begin at a multiple of the "
            "alignment asked for; it counts as none");
        return nullptr;
    }
    alignment = std::max(alignment, sizeof(void*));
    if (size > SIZE_MAX - alignment) return nullptr;
    return allocate_aligned(std::max<size_t>(size, 1), alignment);
}

void Services::release(void* memory) const noexcept {
    if (memory == nullptr) return;
    if (desc_.free == nullptr) return free_aligned(memory);
    if (ended_) return;
    const CallbackScope scope;
    try {
        desc_.free(desc_.alloc_user, memory);
    } catch (...) {
    }
}

void Services::parallel_for_raw(size_t count, void (*body)(void* arg, size_t index),
                                void* arg) const noexcept {
    if (pool_ != nullptr) return pool_->parallel_for(count, body, arg);
    if (ended_) {
        for (size_t i = 0; i < count; ++i) body(arg, i);
        return;
    }
    const CallbackScope scope;
    try {
        LentLoop& loop = *LentLoop::take();
        const Closing closing{loop};
        loop.open(count, body, arg);
        desc_.parallel_for(desc_.parallel_for_user, count, LentLoop::run, &loop);
    } catch (...) {
        parallel_failure = true;
    }
}

uint32_t Services::concurrency() const noexcept { return desc_.threads; }

void Services::forget_parallel_failure() noexcept { parallel_failure = false; }

void Services::expect_parallel_success(const char* what) {
    if (std::exchange(parallel_failure, false))
        fail(DEFREC_ERROR_STATE, what,
             ": the application's parallel_for did not call every body once");
}

}  // namespace defrec
