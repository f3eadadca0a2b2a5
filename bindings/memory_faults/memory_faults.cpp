// A library to preload into a test of a binding: one allocation of libdefrec and its plugins fails.
// It stands in for operator new of the process and for aligned_alloc, which is the library's
// default allocator. What others ask for (the interpreter, its modules) never fails.
#include <dlfcn.h>

#include <cerrno>
#include <cstring>

#include "sdk/base/test_operator_new.hpp"

namespace {

std::atomic<long> countdown{-1};  // allocations until one fails; negative: none does

// The plugins are loaded through a descriptor; what the standard library takes, it takes for them.
bool is_of_library(void* caller) {
    Dl_info info;
    if (dladdr(caller, &info) == 0 || info.dli_fname == nullptr) return false;
    for (const char* part : {"libdefrec.so", "defrec_plugin_", "/proc/self/fd/", "libstdc++"})
        if (std::strstr(info.dli_fname, part) != nullptr) return true;
    return false;
}

}  // namespace

bool defrec::test::allocation_fails(void* caller) {
    if (countdown.load(std::memory_order_relaxed) < 0 || !is_of_library(caller)) return false;
    return countdown.fetch_sub(1) == 0;
}

// The allocation after so many more fails; negative: none does.
extern "C" void defrec_fail_allocation(long number) { countdown = number; }
// Whether there were too few for that.
extern "C" int defrec_is_failure_to_come() { return countdown >= 0 ? 1 : 0; }
// Blocks of operator new.
extern "C" long defrec_live_allocations() { return defrec::test::live; }

extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
    void* memory = nullptr;
    errno = defrec::test::allocation_fails(__builtin_return_address(0))
                ? ENOMEM
                : posix_memalign(&memory, alignment, size);
    return memory;
}
