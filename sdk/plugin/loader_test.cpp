// The loader through the C API: every refusal has a reason, and the rest goes on.
#include <doctest/doctest.h>

#include "include/defrec_plugin.h"
#include "sdk/base/util/error.hpp"
#include "sdk/plugin/test_loader.hpp"

using namespace defrec::test;
namespace fs = std::filesystem;

TEST_CASE("a good plugin is loaded and its device listed") {
    const TestContext context({stub_folder("good").string()});
    REQUIRE(defrec_plugin_count(context.get()) == 1);
    const defrec_plugin_info plugin = context.plugin(0);
    CHECK(plugin.verdict == DEFREC_OK);
    CHECK(std::string(plugin.reason).empty());
    CHECK(std::string(plugin.name) == "good");
    CHECK(std::string(plugin.version) == "1.2.3");
    CHECK(fs::path(plugin.path) == stub_folder("good") / kManifest);
    REQUIRE(defrec_device_count(context.get()) == 1);
    defrec_device_info device;
    DEFREC_INIT(&device);
    REQUIRE(defrec_device_get(context.get(), 0, &device) == DEFREC_OK);
    CHECK(std::string(device.id) == "stub");
    CHECK(device.stages == 1u << DEFREC_STAGE_RANSAC);
}

TEST_CASE(
    "a call that misses a device says which plugins were refused and why, or that there are none") {
    const auto message = [](const TestContext& context, const char* device) {
        defrec_ransac_params params;
        DEFREC_INIT(&params);
        params.landmarks = 1;
        defrec_stage stage = nullptr;
        REQUIRE(defrec_stage_create(context.get(), device, DEFREC_STAGE_RANSAC, &params, &stage) <
                0);
        return std::string(defrec_last_error());
    };
    const TemporaryFolder folder;
    for (const char* device : {static_cast<const char*>(nullptr), "cpu"}) {
        CHECK(contains(message(TestContext({folder.path().string()}), device),
                       "; no plugin was found"));
        write_file(folder.path() / kManifest, manifest_text(kLibrary, {}));
        const TestContext context({folder.path().string()});
        CHECK(contains(message(context, device),
                       "; a plugin was refused: " + std::string(context.plugin(0).reason)));
        fs::remove(folder.path() / kManifest);
    }
    CHECK_FALSE(contains(message(TestContext({stub_folder("good").string()}), "cpu"), "plugin"));
}

TEST_CASE("row 32: a library cut off anywhere is refused") {
    const size_t whole = read_file(stub_folder("good") / kLibrary).size();
    for (const size_t size : {size_t{0}, size_t{1}, size_t{63}, size_t{64}, size_t{500},
                              size_t{4096}, whole / 2, whole - 1}) {
        CAPTURE(size);
        check_changed([&](auto& bytes) { bytes.resize(size); }, true, DEFREC_ERROR_PLUGIN,
                      {kLibrary});
    }
}

TEST_CASE("row 34: one flipped bit is refused") {
    const size_t whole = read_file(stub_folder("good") / kLibrary).size();
    for (size_t at = 100; at < whole; at += whole / 20)
        check_changed([&](auto& bytes) { bytes[at] ^= 4; }, false, DEFREC_ERROR_PLUGIN, {kLibrary});
    check_changed([&](auto& bytes) { bytes[whole / 2] ^= 1; }, false, DEFREC_ERROR_PLUGIN,
                  {"SHA-256", "changed or damaged"});
}

TEST_CASE("row 35: a library without the entry") {
    check_refused(stub_folder("missing_symbol"), DEFREC_ERROR_PLUGIN,
                  {"does not export defrec_plugin_entry_v1"});
}

TEST_CASE("row 36: plugins of an older and of a newer ABI") {
    check_refused(stub_folder("older_abi"), DEFREC_ERROR_VERSION, {"ABI 0.9", "speaks 1.0"});
    check_refused(stub_folder("newer_abi"), DEFREC_ERROR_VERSION, {"ABI 2.0", "speaks 1.0"});
    check_refused(stub_folder("other_minor"), DEFREC_ERROR_VERSION, {"minor 2", "the library 0"});
    check_refused(stub_folder("other_stage_version"), DEFREC_ERROR_VERSION,
                  {"stage ransac", "version 2"});
    check_refused(stub_folder("short_table"), DEFREC_ERROR_VERSION,
                  {defrec::concat(sizeof(defrec_plugin) - sizeof(void*), " bytes")});
}

TEST_CASE("row 36: a plugin of a later minor version is loaded, whose table is longer") {
    for (const char* name : {"good", "later_minor"}) {
        CAPTURE(name);
        const TestContext context({stub_folder(name).string()});
        REQUIRE(defrec_plugin_count(context.get()) == 1);
        CHECK(context.plugin(0).verdict == DEFREC_OK);
        CHECK(defrec_device_count(context.get()) == 1);
    }
}

TEST_CASE("row 37: tables with NULL in them, and entries that fail") {
    check_refused(stub_folder("null_entry"), DEFREC_ERROR_PLUGIN, {"NULL for read"});
    check_refused(stub_folder("null_stage_entry"), DEFREC_ERROR_PLUGIN, {"stage ransac", "NULL"});
    check_refused(stub_folder("claims_stage"), DEFREC_ERROR_PLUGIN, {"claims the stage lm"});
    check_refused(stub_folder("host_alloc_alone"), DEFREC_ERROR_PLUGIN,
                  {"NULL for host_free", "host_alloc"});
    check_refused(stub_folder("no_table"), DEFREC_ERROR_PLUGIN, {"without a table"});
    check_refused(stub_folder("no_id"), DEFREC_ERROR_PLUGIN, {"no id"});
    check_refused(stub_folder("many_devices"), DEFREC_ERROR_PLUGIN, {"at most 64"});
    check_refused(stub_folder("entry_fails"), DEFREC_ERROR_UNSUPPORTED, {"driver is too old"});
}

TEST_CASE("a plugin whose entry has no memory is refused; the others are used") {
    const TestContext context(
        {stub_folder("entry_out_of_memory").string(), stub_folder("twin").string()});
    REQUIRE(defrec_plugin_count(context.get()) == 2);
    CHECK(context.plugin(0).verdict == DEFREC_ERROR_OUT_OF_MEMORY);
    CHECK(contains(context.plugin(0).reason, "the stub's card is full"));
    CHECK(context.plugin(1).verdict == DEFREC_OK);
    CHECK(defrec_device_count(context.get()) == 1);
}

TEST_CASE("a device that cannot be described is left out with its reason; the others are used") {
    const TestContext context({stub_folder("broken_device").string()});
    REQUIRE(defrec_plugin_count(context.get()) == 1);
    const defrec_plugin_info plugin = context.plugin(0);
    CHECK(plugin.verdict == DEFREC_OK);
    CHECK(contains(plugin.reason, "device 1 is left out: the stub fell off the bus"));
    REQUIRE(defrec_device_count(context.get()) == 2);
    for (const auto& [index, id] : {std::pair{size_t{0}, "stub:0"}, {size_t{1}, "stub:2"}}) {
        defrec_device_info device;
        DEFREC_INIT(&device);
        REQUIRE(defrec_device_get(context.get(), index, &device) == DEFREC_OK);
        CHECK(std::string(device.id) == id);
    }
    defrec_ransac_params params;
    DEFREC_INIT(&params);
    params.landmarks = 1;
    defrec_stage stage = nullptr;
    CHECK(defrec_stage_create(context.get(), "stub:2", DEFREC_STAGE_RANSAC, &params, &stage) ==
          DEFREC_OK);
    defrec_stage_destroy(stage);
    CHECK(defrec_stage_create(context.get(), "stub:0", DEFREC_STAGE_RANSAC, &params, &stage) ==
          DEFREC_ERROR_DEVICE_LOST);
    CHECK(contains(defrec_last_error(), "device 0 was opened"));
    CHECK(defrec_stage_create(context.get(), "stub:1", DEFREC_STAGE_RANSAC, &params, &stage) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "the stub fell off the bus"));
}

TEST_CASE("a plugin of broken devices alone is loaded without any, and says why") {
    const TestContext context(
        {stub_folder("broken_devices").string(), stub_folder("twin").string()});
    REQUIRE(defrec_plugin_count(context.get()) == 2);
    const defrec_plugin_info plugin = context.plugin(0);
    CHECK(plugin.verdict == DEFREC_OK);
    CHECK(contains(plugin.reason, "device 0 is left out: the stub is full; device 1 is left out"));
    CHECK(contains(plugin.reason, "device 2 is left out"));
    CHECK(std::string(context.plugin(1).reason).empty());
    CHECK(defrec_device_count(context.get()) == 1);
}

TEST_CASE("row 40: duplicate names and ids are resolved the same way every time") {
    check_refused(stub_folder("duplicate_ids"), DEFREC_ERROR_PLUGIN,
                  {"two of the plugin's devices", "stub"});

    const TemporaryFolder folder;
    const auto bytes = read_file(stub_folder("good") / kLibrary);
    write_file(folder.path() / kLibrary, bytes);
    write_file(folder.path() / kManifest, manifest_text(kLibrary, bytes));
    const TestContext context(
        {stub_folder("good").string(), folder.path().string(), stub_folder("twin").string()});
    REQUIRE(defrec_plugin_count(context.get()) == 3);
    CHECK(context.plugin(0).verdict == DEFREC_OK);
    CHECK(context.plugin(1).verdict == DEFREC_ERROR_PLUGIN);
    CHECK(contains(context.plugin(1).reason, "loaded before"));
    CHECK(context.plugin(2).verdict == DEFREC_OK);
    CHECK(defrec_device_count(context.get()) == 1);  // twin's device has the same id
}

TEST_CASE("a manifest must name the library that it describes") {
    const TemporaryFolder folder;
    const auto bytes = read_file(stub_folder("twin") / library_name("twin"));
    write_file(folder.path() / kLibrary, bytes);
    write_file(folder.path() / kManifest, manifest_text(kLibrary, bytes));
    check_refused(folder.path(), DEFREC_ERROR_PLUGIN, {"calls itself \"twin\"", "\"good\""});
}
