// What a tracker owes its device when a frame fails.
#include <doctest/doctest.h>

#include <string>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_frames.hpp"

using namespace defrec::test;

TEST_CASE("what a lost device may still copy from and to stays until its queue is gone") {
    std::string errors;
    const std::string folder = stub_folder("late").string();
    const char* places[] = {folder.c_str()};
    defrec_context_desc desc;
    DEFREC_INIT(&desc);
    desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    desc.plugin_paths = places;
    desc.plugin_path_count = 1;
    desc.threads = 1;
    desc.log_level = DEFREC_LOG_ERROR;
    desc.log_user = &errors;
    desc.log = [](void* user, int32_t, const char*, const char* text) {
        *static_cast<std::string*>(user) += text;
    };
    {
        const TestContext context(desc);
        const defrec_rig_desc rig_desc = small_rig();
        defrec_rig rig = nullptr;
        REQUIRE(defrec_rig_create(context.get(), &rig_desc, &rig) == DEFREC_OK);
        defrec_tracker_desc tracker_desc;
        DEFREC_INIT(&tracker_desc);
        tracker_desc.format = DEFREC_FORMAT_GRAY8;
        defrec_tracker tracker = nullptr;
        REQUIRE(defrec_tracker_create(context.get(), rig, &tracker_desc, &tracker) == DEFREC_OK);
        SmallFrame frame;
        defrec_job jobs[2];
        for (defrec_job& job : jobs) {
            REQUIRE(defrec_tracker_submit(tracker, &frame.frame, &job) == DEFREC_OK);
            ++frame.frame.timestamp_ns;
            CHECK(defrec_job_wait(job, UINT64_MAX) == DEFREC_ERROR_DEVICE_LOST);
        }
        defrec_job_release(jobs[0]);
        defrec_tracker_destroy(tracker);
        defrec_job_release(jobs[1]);
        defrec_rig_destroy(rig);
    }
    CHECK(errors.empty());
}
