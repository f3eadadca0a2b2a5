// A library to preload into a test of a binding: one allocation of libdefrec and its plugins fails.
// It stands in for operator new of the process and for aligned_alloc, which is the library's
// default allocator. What others ask for (the interpreter, its modules) never fails.
#include <cerrno>

#include "sdk/testing/test_operator_new.hpp"

namespace {

std::atomic<long> countdown{-1};  // allocations until one fails; negative: none does

}  // namespace

bool defrec::test::allocation_fails() {
    return countdown.load(std::memory_order_relaxed) >= 0 && countdown.fetch_sub(1) == 0;
}

// The allocation after so many more fails; negative: none does.
extern "C" void defrec_fail_allocation(long number) { countdown = number; }
// Whether there were too few for that.
extern "C" int defrec_is_failure_to_come() { return countdown >= 0 ? 1 : 0; }
// Blocks of the library's operator new.
extern "C" long defrec_live_allocations() { return defrec::test::live; }

extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
    void* memory = nullptr;
    const bool fails = defrec::test::is_of_library(__builtin_return_address(0)) &&
                       defrec::test::allocation_fails();
    errno = fails ? ENOMEM : posix_memalign(&memory, alignment, size);
    return memory;
}
