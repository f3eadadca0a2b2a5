// A hostile caller: NULL, destroyed, random and foreign handles, NULL and senseless arguments, for
// every exported function.
#include <doctest/doctest.h>

#include <cstring>
#include <functional>
#include <set>
#include <string>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_frames.hpp"

using namespace defrec::test;

namespace {

template <class Handle>
struct Use {
    const char* name;
    std::function<defrec_status(Handle)> call;
};

double numbers[64];
uint8_t bytes[64];

template <class Struct>
Struct init() {
    Struct s;
    DEFREC_INIT(&s);
    return s;
}

// Every function that takes the handle first and answers with a status, called with otherwise good
// arguments.
const std::vector<Use<defrec_context>> kContextUses = {
    {"defrec_plugin_get",
     [](auto h) {
         auto out = init<defrec_plugin_info>();
         return defrec_plugin_get(h, 0, &out);
     }},
    {"defrec_device_get",
     [](auto h) {
         auto out = init<defrec_device_info>();
         return defrec_device_get(h, 0, &out);
     }},
    {"defrec_rig_create",
     [](auto h) {
         const defrec_rig_desc desc = small_rig();
         defrec_rig out = nullptr;
         const defrec_status status = defrec_rig_create(h, &desc, &out);
         defrec_rig_destroy(out);
         return status;
     }},
    {"defrec_stage_create",
     [](auto h) {
         const defrec_ransac_params params = small_ransac();
         defrec_stage out = nullptr;
         const defrec_status status =
             defrec_stage_create(h, "stub", DEFREC_STAGE_RANSAC, &params, &out);
         defrec_stage_destroy(out);
         return status;
     }},
};
const std::vector<Use<defrec_rig>> kRigUses = {
    {"defrec_rig_get",
     [](auto h) {
         auto out = init<defrec_rig_info>();
         return defrec_rig_get(h, &out);
     }},
    {"defrec_rig_rectify_pixels",
     [](auto h) { return defrec_rig_rectify_pixels(h, numbers, 4, numbers); }},
    {"defrec_rig_distort_pixels",
     [](auto h) { return defrec_rig_distort_pixels(h, numbers, 4, numbers); }},
};
const std::vector<Use<defrec_stage>> kStageUses = {
    {"defrec_stage_prepare",
     [](auto h) {
         const defrec_const_buffer in{bytes, 48};
         return defrec_stage_prepare(h, &in, 1);
     }},
    {"defrec_stage_run",
     [](auto h) {
         const defrec_const_buffer in{bytes, 64};
         const defrec_buffer out{numbers, 64};
         return defrec_stage_run(h, &in, 1, &out, 1);
     }},
};
// These need more than a live handle to succeed, so only dead ones are tried.
const std::vector<Use<defrec_tracker>> kTrackerUses = {
    {"defrec_tracker_submit",
     [](auto h) {
         const SmallFrame frame;
         defrec_job out = nullptr;
         return defrec_tracker_submit(h, &frame.frame, &out);
     }},
    {"defrec_memory_import",
     [](auto h) {
         auto desc = init<defrec_memory_desc>();
         defrec_memory out = nullptr;
         return defrec_memory_import(h, &desc, &out);
     }},
    {"defrec_tracker_get_template",
     [](auto h) {
         defrec_template out = nullptr;
         return defrec_tracker_get_template(h, &out);
     }},
    {"defrec_tracker_set_template", [](auto h) { return defrec_tracker_set_template(h, nullptr); }},
};
const std::vector<Use<defrec_job>> kJobUses = {
    {"defrec_job_wait", [](auto h) { return defrec_job_wait(h, 0); }},
    {"defrec_job_result",
     [](auto h) {
         auto out = init<defrec_result>();
         return defrec_job_result(h, &out);
     }},
    {"defrec_job_get_template",
     [](auto h) {
         defrec_template out = nullptr;
         return defrec_job_get_template(h, &out);
     }},
    {"defrec_job_lift_points",
     [](auto h) { return defrec_job_lift_points(h, numbers, 1, numbers, bytes); }},
    {"defrec_job_warp_points",
     [](auto h) { return defrec_job_warp_points(h, numbers, 1, numbers, nullptr, nullptr); }},
    {"defrec_job_point_covariances",
     [](auto h) { return defrec_job_point_covariances(h, numbers, 1, numbers, nullptr); }},
};
const std::vector<Use<defrec_template>> kTemplateUses = {
    {"defrec_template_get",
     [](auto h) {
         auto out = init<defrec_template_info>();
         return defrec_template_get(h, &out);
     }},
    {"defrec_template_lift",
     [](auto h) { return defrec_template_lift(h, numbers, 1, numbers, bytes); }},
    {"defrec_template_point_pieces",
     [](auto h) { return defrec_template_point_pieces(h, numbers, 1, bytes); }},
    {"defrec_template_save", [](auto h) { return defrec_template_save(h, "/nowhere/template"); }},
};

template <class Handle>
void check_dead_handles(const std::vector<Use<Handle>>& uses, Handle destroyed, void* foreign) {
    for (const auto& use : uses) {
        CAPTURE(use.name);
        CHECK(use.call(nullptr) == DEFREC_ERROR_ARGUMENT);
        CHECK(contains(defrec_last_error(), "NULL"));
        CHECK(use.call(static_cast<Handle>(foreign)) == DEFREC_ERROR_HANDLE);
        if (destroyed != nullptr) CHECK(use.call(destroyed) == DEFREC_ERROR_HANDLE);
        int on_stack = 0;
        const uint64_t random[] = {1,
                                   8,
                                   0xDEADBEEF,
                                   0xDF00000000000001,
                                   0xDF07000000000001,
                                   0xDFFF000000000001,
                                   UINT64_MAX,
                                   reinterpret_cast<uintptr_t>(&on_stack)};
        for (const uint64_t bits : random)
            CHECK(use.call(reinterpret_cast<Handle>(static_cast<uintptr_t>(bits))) ==
                  DEFREC_ERROR_HANDLE);
    }
}

template <class Handle>
void check_live_handle(const std::vector<Use<Handle>>& uses, Handle live) {
    for (const auto& use : uses) {
        CAPTURE(use.name);
        const defrec_status status = use.call(live);
        INFO(defrec_last_error());
        CHECK(status == DEFREC_OK);
    }
}

}  // namespace

TEST_CASE("row 16: every function answers NULL, destroyed, random and foreign handles") {
    TestContext context({stub_folder("good").string()});
    const defrec_rig_desc rig_desc = small_rig();
    const defrec_ransac_params ransac = small_ransac();
    defrec_rig rig = nullptr;
    defrec_stage stage = nullptr;
    defrec_context other = nullptr;
    REQUIRE(defrec_rig_create(context.get(), &rig_desc, &rig) == DEFREC_OK);
    REQUIRE(defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_RANSAC, &ransac, &stage) ==
            DEFREC_OK);
    REQUIRE(defrec_context_create(nullptr, &other) == DEFREC_OK);
    check_live_handle(kContextUses, context.get());
    check_live_handle(kRigUses, rig);
    check_live_handle(kStageUses, stage);
    const defrec_rig dead_rig = rig;
    const defrec_stage dead_stage = stage;
    const defrec_context dead_context = other;
    defrec_rig_destroy(rig);
    defrec_stage_destroy(stage);
    defrec_context_destroy(other);
    check_dead_handles(kContextUses, dead_context, dead_rig);
    check_dead_handles(kRigUses, dead_rig, context.get());
    check_dead_handles(kStageUses, dead_stage, context.get());
    check_dead_handles<defrec_tracker>(kTrackerUses, nullptr, context.get());
    check_dead_handles<defrec_job>(kJobUses, nullptr, context.get());
    check_dead_handles<defrec_template>(kTemplateUses, nullptr, context.get());
    CHECK(defrec_plugin_count(nullptr) == 0);
    CHECK(defrec_device_count(reinterpret_cast<defrec_context>(dead_rig)) == 0);
}

TEST_CASE("row 16: destroying NULL, twice, or something else does nothing") {
    TestContext context;
    const defrec_rig_desc desc = small_rig();
    defrec_rig rig = nullptr;
    REQUIRE(defrec_rig_create(context.get(), &desc, &rig) == DEFREC_OK);
    void* const values[] = {nullptr, rig, reinterpret_cast<void*>(uintptr_t{42})};
    for (void* value : values) {
        defrec_context_destroy(static_cast<defrec_context>(value));
        defrec_tracker_destroy(static_cast<defrec_tracker>(value));
        defrec_template_release(static_cast<defrec_template>(value));
        defrec_job_release(static_cast<defrec_job>(value));
        defrec_stage_destroy(static_cast<defrec_stage>(value));
        defrec_memory_release(static_cast<defrec_memory>(value));
    }
    check_live_handle(kRigUses, rig);
    defrec_rig_destroy(rig);
    defrec_rig_destroy(rig);
    CHECK(contains(defrec_last_error(), "destroyed already"));
    CHECK(defrec_plugin_count(context.get()) == 0);
}

TEST_CASE("handles may be destroyed in any order, and are never used twice") {
    std::set<void*> seen;
    const defrec_rig_desc desc = small_rig();
    auto no_plugins = init<defrec_context_desc>();
    no_plugins.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    for (int i = 0; i < 20; ++i) {
        defrec_context context = nullptr;
        defrec_rig rig = nullptr;
        REQUIRE(defrec_context_create(&no_plugins, &context) == DEFREC_OK);
        REQUIRE(defrec_rig_create(context, &desc, &rig) == DEFREC_OK);
        CHECK(seen.insert(context).second);
        CHECK(seen.insert(rig).second);
        defrec_context_destroy(context);
        check_live_handle(kRigUses, rig);
        defrec_rig_destroy(rig);
    }
}

TEST_CASE("row 16: NULL in the place of a required argument, and nothing is written") {
    TestContext context({stub_folder("good").string()});
    const defrec_context c = context.get();
    const defrec_rig_desc desc = small_rig();
    const defrec_ransac_params ransac = small_ransac();
    defrec_rig rig = nullptr;
    defrec_stage stage = nullptr;
    defrec_tracker tracker = nullptr;
    defrec_template surface = nullptr;
    REQUIRE(defrec_rig_create(c, &desc, &rig) == DEFREC_OK);
    CHECK(defrec_context_create(nullptr, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_plugin_get(c, 0, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_device_get(c, 0, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_rig_create(c, nullptr, &rig) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_rig_create(c, &desc, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_rig_get(rig, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_rig_rectify_pixels(rig, nullptr, 1, numbers) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_rig_distort_pixels(rig, numbers, 1, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_rig_rectify_pixels(rig, nullptr, 0, nullptr) == DEFREC_OK);
    CHECK(defrec_rig_rectify_pixels(rig, numbers, SIZE_MAX, numbers) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_stage_create(c, nullptr, DEFREC_STAGE_RANSAC, nullptr, &stage) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_stage_create(c, nullptr, DEFREC_STAGE_RANSAC, &ransac, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_tracker_create(c, rig, nullptr, &tracker) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_tracker_create(c, nullptr, nullptr, &tracker) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_tracker_create(c, rig, nullptr, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_template_load(c, nullptr, &surface) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_template_load(c, "/nowhere", nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(stage == nullptr);
    CHECK(tracker == nullptr);
    CHECK(surface == nullptr);
    defrec_rig_destroy(rig);
}

TEST_CASE("rows 18 and 19: indices out of range, unknown flags, stages, devices") {
    TestContext context({stub_folder("good").string()});
    auto device = init<defrec_device_info>();
    auto plugin = init<defrec_plugin_info>();
    CHECK(defrec_device_get(context.get(), 1, &device) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_plugin_get(context.get(), SIZE_MAX, &plugin) == DEFREC_ERROR_ARGUMENT);
    CHECK(device.id == nullptr);

    defrec_context other = nullptr;
    auto desc = init<defrec_context_desc>();
    desc.flags = 4;
    CHECK(defrec_context_create(&desc, &other) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "flags"));
    desc = init<defrec_context_desc>();
    desc.plugin_path_count = 1;
    CHECK(defrec_context_create(&desc, &other) == DEFREC_ERROR_ARGUMENT);
    const char* no_path[] = {nullptr};
    desc.plugin_paths = no_path;
    CHECK(defrec_context_create(&desc, &other) == DEFREC_ERROR_ARGUMENT);
    desc = init<defrec_context_desc>();
    desc.threads = 100000;
    CHECK(defrec_context_create(&desc, &other) == DEFREC_ERROR_ARGUMENT);
    desc = init<defrec_context_desc>();
    desc.log_level = 5;
    CHECK(defrec_context_create(&desc, &other) == DEFREC_ERROR_ARGUMENT);
    CHECK(other == nullptr);

    const defrec_ransac_params params = small_ransac();
    defrec_stage stage = nullptr;
    CHECK(defrec_stage_create(context.get(), "stub", 99, &params, &stage) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_stage_create(context.get(), "Stub", DEFREC_STAGE_RANSAC, &params, &stage) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "there are: stub"));
    const auto warp = small_warp();
    CHECK(defrec_stage_create(context.get(), "stub", DEFREC_STAGE_WARP, &warp, &stage) ==
          DEFREC_ERROR_UNSUPPORTED);
    CHECK(contains(defrec_last_error(), "warp"));
    CHECK(defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_WARP, &warp, &stage) ==
          DEFREC_ERROR_UNSUPPORTED);
    CHECK(stage == nullptr);
}

TEST_CASE("row 17: struct_size is checked in every struct, and outputs are written no further") {
    TestContext context({stub_folder("good").string()});
    struct {
        defrec_device_info info;
        unsigned char guard[64];
    } out;
    for (const uint32_t size : {0u, 3u, 70000u}) {
        out.info.struct_size = size;
        CHECK(defrec_device_get(context.get(), 0, &out.info) == DEFREC_ERROR_VERSION);
    }
    for (const uint32_t size :
         {uint32_t{4}, uint32_t{16}, uint32_t(sizeof out.info), uint32_t(sizeof out)}) {
        std::memset(&out, 0xA5, sizeof out);
        out.info.struct_size = size;
        CHECK(defrec_device_get(context.get(), 0, &out.info) == DEFREC_OK);
        const auto* raw = reinterpret_cast<const unsigned char*>(&out);
        for (size_t i = std::min<size_t>(size, sizeof out.info); i < sizeof out; ++i)
            CHECK(raw[i] == 0xA5);
    }
    struct {
        defrec_rig_desc desc;
        uint64_t newer;
    } longer{small_rig(), 0};
    longer.desc.struct_size = sizeof longer;
    defrec_rig rig = nullptr;
    CHECK(defrec_rig_create(context.get(), &longer.desc, &rig) == DEFREC_OK);
    defrec_rig_destroy(rig);
    longer.newer = 1;
    rig = nullptr;
    CHECK(defrec_rig_create(context.get(), &longer.desc, &rig) == DEFREC_ERROR_VERSION);
    CHECK(rig == nullptr);
}

TEST_CASE("statuses have names, and a version has a number and a name") {
    CHECK(defrec_version() == 1000);
    CHECK(std::string(defrec_version_string()).size() >= 5);
    CHECK(std::string(defrec_status_name(DEFREC_ERROR_HANDLE)) == "DEFREC_ERROR_HANDLE");
    CHECK(std::string(defrec_status_name(12345)) == "unknown status");
    std::set<std::string> names;
    for (const int status : {0, 1, -1, -2, -3, -4, -5, -6, -7, -8, -9, -10, -99})
        CHECK(names.insert(defrec_status_name(status)).second);
}
