// The shared driver in a child that the process makes by fork.
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "backends/vulkan/shared_device.hpp"
#include "backends/vulkan/test_device.hpp"

using namespace defrec;
using namespace defrec::vulkan;

namespace {

// ThreadSanitizer ends a child of a process with threads that starts one itself, as drivers do.
#if defined(__SANITIZE_THREAD__)
constexpr bool kForks = false;
#else
constexpr bool kForks = true;
#endif

}  // namespace

TEST_CASE("a forked process does not get its parent's device" * doctest::skip(!kForks)) {
    if (!under_test::available()) return;
    const std::shared_ptr<const Driver> driver = shared_driver();
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        const std::shared_ptr<const Driver> own = shared_driver();
        _exit(own == nullptr || own == driver ? 1 : 0);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    CHECK(shared_driver() == driver);
}
