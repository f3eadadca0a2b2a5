// The faulty plugins load like any other, and only where one asks for them.
#include <doctest/doctest.h>

#include <filesystem>
#include <string>

#include "sdk/testing/test_context.hpp"

namespace {
const std::filesystem::path kFolder = DEFREC_BUILD_DIR "/faulty";
}

TEST_CASE("every faulty plugin loads, with every stage") {
    const defrec::test::TestContext context({kFolder});
    size_t manifests = 0;
    for (const auto& entry : std::filesystem::directory_iterator(kFolder))
        manifests += entry.path().extension() == ".json";
    REQUIRE(manifests > 0);
    REQUIRE(defrec_plugin_count(context.get()) == manifests);
    for (size_t i = 0; i < manifests; ++i) {
        const defrec_plugin_info info = context.plugin(i);
        CAPTURE(info.path);
        CAPTURE(info.reason);
        CHECK(info.verdict == DEFREC_OK);
        CHECK(std::filesystem::path(info.path).stem() == "defrec_plugin_" + std::string(info.name));
    }
    REQUIRE(defrec_device_count(context.get()) == manifests);
    for (size_t i = 0; i < manifests; ++i) {
        defrec_device_info device;
        DEFREC_INIT(&device);
        REQUIRE(defrec_device_get(context.get(), i, &device) == DEFREC_OK);
        CHECK(device.stages == (1u << DEFREC_STAGE_COUNT_V1) - 1);
    }
}

TEST_CASE("no context finds a faulty plugin by itself") {
    defrec_context_desc desc;
    DEFREC_INIT(&desc);
    const defrec::test::TestContext context(desc);
    for (size_t i = 0; i < defrec_plugin_count(context.get()); ++i)
        CHECK(!defrec::test::contains(context.plugin(i).path, "/faulty/"));
}
