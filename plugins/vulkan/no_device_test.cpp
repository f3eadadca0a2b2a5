// The plugin where there is no Vulkan driver, or no Vulkan loader. CMakeLists.txt hides the
// drivers: what a program for Windows puts into its environment does not reach those that Wine
// uses.
#include <doctest/doctest.h>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec::test;

namespace {

std::string manifest_of(const std::string& plugin) {
    return DEFREC_BUILD_DIR "/lib/defrec_plugin_" + plugin + ".json";
}

}  // namespace

TEST_CASE("row 44: without a driver the plugin lists no device, and other plugins' are used") {
    const TestContext context({manifest_of("vulkan"), manifest_of("cpu")}, 2);
    const defrec_plugin_info info = context.plugin(0);
    CHECK(std::string(info.name) == "vulkan");
    CAPTURE(info.reason);
    CHECK(info.verdict == DEFREC_OK);
    REQUIRE(defrec_device_count(context.get()) > 0);
    for (size_t i = 0; i < defrec_device_count(context.get()); ++i) {
        defrec_device_info device;
        DEFREC_INIT(&device);
        REQUIRE_OK(defrec_device_get(context.get(), i, &device));
        CHECK_FALSE(contains(device.id, "vulkan"));
    }

    const defrec_rig_desc rig_desc = scene_rig();
    defrec_rig rig = nullptr;
    REQUIRE_OK(defrec_rig_create(context.get(), &rig_desc, &rig));
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    desc.format = DEFREC_FORMAT_GRAY8;
    defrec_tracker tracker = nullptr;
    for (const char* device : {"vulkan:0", "vulkan:*"}) {
        CAPTURE(device);
        desc.device_id = device;
        CHECK(defrec_tracker_create(context.get(), rig, &desc, &tracker) == DEFREC_ERROR_ARGUMENT);
        CHECK(contains(defrec_last_error(), "no device is called \"" + std::string(device)));
        CHECK(tracker == nullptr);
    }
    desc.device_id = "cpu";
    REQUIRE_OK(defrec_tracker_create(context.get(), rig, &desc, &tracker));
    defrec_tracker_destroy(tracker);
    defrec_rig_destroy(rig);
}
