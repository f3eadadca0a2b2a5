// After fork the child's copies of handles are of no use, and say so.
#include <doctest/doctest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_frames.hpp"

using namespace defrec::test;

namespace {
// ThreadSanitizer ends a child of a process with threads that starts one itself.
#if defined(__SANITIZE_THREAD__)
constexpr uint32_t kChildThreads = 1;
#else
constexpr uint32_t kChildThreads = 2;
#endif
}  // namespace

TEST_CASE("row 30: a handle from before a fork is a state error in the child, and new ones work") {
    const TestContext context({}, 2);
    const defrec_rig_desc desc = small_rig();
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        defrec_rig rig = nullptr;
        if (defrec_rig_create(context.get(), &desc, &rig) != DEFREC_ERROR_STATE) _exit(1);
        if (!contains(defrec_last_error(), "fork")) _exit(2);
        defrec_context_destroy(context.get());
        defrec_context own = nullptr;
        defrec_context_desc own_desc;
        DEFREC_INIT(&own_desc);
        own_desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
        own_desc.threads = kChildThreads;
        if (defrec_context_create(&own_desc, &own) != DEFREC_OK) _exit(3);
        if (defrec_rig_create(own, &desc, &rig) != DEFREC_OK) _exit(4);
        defrec_rig_destroy(rig);
        defrec_context_destroy(own);
        _exit(0);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    defrec_rig rig = nullptr;
    CHECK(defrec_rig_create(context.get(), &desc, &rig) == DEFREC_OK);
    defrec_rig_destroy(rig);
}

TEST_CASE("row 103: process numbers that repeat do not make a handle another process's") {
    const TestContext context({}, kChildThreads);
    const defrec_rig_desc desc = small_rig();
    // The child and its child are both number 1, each of a name space of its own, where the system
    // allows that.
    const auto in_name_space = [](const auto& body) {
        const pid_t child = fork();
        if (child == 0) {
            if (unshare(CLONE_NEWPID) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWPID) != 0) _exit(77);
            const pid_t first = fork();
            if (first == 0) _exit(body());
            int status = 0;
            _exit(waitpid(first, &status, 0) == first && WIFEXITED(status) ? WEXITSTATUS(status)
                                                                           : 1);
        }
        int status = 0;
        REQUIRE(waitpid(child, &status, 0) == child);
        return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
    };
    const int code = in_name_space([&] {
        defrec_context_desc own_desc;
        DEFREC_INIT(&own_desc);
        own_desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
        own_desc.threads = 1;
        defrec_context own = nullptr;
        if (getpid() != 1) return 2;
        if (defrec_context_create(&own_desc, &own) != DEFREC_OK) return 3;
        return in_name_space([&] {
            defrec_rig rig = nullptr;
            if (getpid() != 1) return 4;
            return defrec_rig_create(own, &desc, &rig) == DEFREC_ERROR_STATE ? 0 : 5;
        });
    });
    if (code == 77)
        MESSAGE("name spaces of processes are not allowed here");
    else
        CHECK(code == 0);
}
