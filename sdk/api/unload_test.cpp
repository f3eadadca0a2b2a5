// The library as a plugin of an application: loaded, closed and loaded again.
#include <dlfcn.h>
#include <doctest/doctest.h>

#include "include/defrec_c.h"
#include "sdk/testing/test_scene.hpp"

using namespace defrec::test;

namespace {

template <class Function>
Function* find(void* library, const char* name) {
    return reinterpret_cast<Function*>(dlsym(library, name));
}
#define FIND(name) const auto name = find<decltype(defrec_##name)>(library, "defrec_" #name)

}  // namespace

TEST_CASE("rows 41 and 90: the library stays when it is closed with a frame under way") {
    const char* path = DEFREC_BUILD_DIR "/lib/libdefrec.so";
    void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    REQUIRE(library != nullptr);
    FIND(context_create);
    FIND(rig_create);
    FIND(tracker_create);
    FIND(tracker_submit);
    defrec_context context = nullptr;
    REQUIRE(context_create(nullptr, &context) == DEFREC_OK);
    const defrec_rig_desc rig_desc = scene_rig();
    defrec_rig rig = nullptr;
    REQUIRE(rig_create(context, &rig_desc, &rig) == DEFREC_OK);
    defrec_tracker_desc tracker_desc;
    DEFREC_INIT(&tracker_desc);
    tracker_desc.format = DEFREC_FORMAT_GRAY8;
    tracker_desc.device_id = "cpu";
    defrec_tracker tracker = nullptr;
    REQUIRE(tracker_create(context, rig, &tracker_desc, &tracker) == DEFREC_OK);
    const Pair pair = render(0, 0);
    defrec_image left, right;
    DEFREC_INIT(&left);
    left.format = DEFREC_FORMAT_GRAY8;
    left.width = kWidth;
    left.height = kHeight;
    right = left;
    left.pixels = pair.left.data();
    right.pixels = pair.right.data();
    defrec_frame frame;
    DEFREC_INIT(&frame);
    frame.left = &left;
    frame.right = &right;
    defrec_job job = nullptr;
    REQUIRE(tracker_submit(tracker, &frame, &job) == DEFREC_OK);
    REQUIRE(dlclose(library) == 0);

    library = dlopen(path, RTLD_NOW | RTLD_NOLOAD);
    REQUIRE(library != nullptr);  // it never went
    FIND(job_wait);
    FIND(job_release);
    FIND(tracker_destroy);
    FIND(rig_destroy);
    FIND(context_destroy);
    CHECK(job_wait(job, UINT64_MAX) == DEFREC_OK);
    job_release(job);
    CHECK(job_wait(job, 0) == DEFREC_ERROR_HANDLE);
    tracker_destroy(tracker);
    rig_destroy(rig);
    context_destroy(context);
    // Nor do plugins go, whose threads may be under way.
    CHECK(dlopen(DEFREC_BUILD_DIR "/lib/defrec_plugin_cpu.so", RTLD_NOW | RTLD_NOLOAD) != nullptr);
}
