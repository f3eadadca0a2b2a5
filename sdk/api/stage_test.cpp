// Stages on their own through the C API, with the stub plugin, whose stage ransac copies input 0 to
// output 0, and the reference.
#include <doctest/doctest.h>

#include <cstddef>
#include <cstring>
#include <numeric>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_frames.hpp"

using namespace defrec::test;

namespace {

class TestStage {
  public:
    template <class Params>
    TestStage(const TestContext& context, uint32_t stage, const Params& params) {
        const defrec_status status =
            defrec_stage_create(context.get(), nullptr, stage, &params, &handle_);
        INFO(defrec_last_error());
        REQUIRE(status == DEFREC_OK);
    }
    ~TestStage() { defrec_stage_destroy(handle_); }
    TestStage(const TestStage&) = delete;
    TestStage& operator=(const TestStage&) = delete;

    defrec_status prepare() {
        static const uint8_t landmarks[48] = {};
        const defrec_const_buffer in{landmarks, sizeof landmarks};
        return defrec_stage_prepare(handle_, &in, 1);
    }
    defrec_status run(std::vector<defrec_const_buffer> in, std::vector<defrec_buffer> out) {
        return defrec_stage_run(handle_, in.data(), in.size(), out.data(), out.size());
    }
    defrec_stage get() const { return handle_; }

  private:
    defrec_stage handle_ = nullptr;
};

defrec_rectify_params rectify_params() {
    defrec_rectify_params params;
    DEFREC_INIT(&params);
    params.format = DEFREC_FORMAT_GRAY8;
    params.source_width = 65;
    params.source_height = 49;
    params.stride = 80;
    return params;
}

std::string reference() {
    return std::string(DEFREC_BUILD_DIR) + "/lib/defrec_plugin_reference.json";
}

}  // namespace

TEST_CASE("a stage runs on host memory, again and again with other sizes") {
    const TestContext context({stub_folder("good").string()});
    TestStage stage(context, DEFREC_STAGE_RANSAC, small_ransac());
    REQUIRE(stage.prepare() == DEFREC_OK);
    for (const size_t size : {size_t{40}, size_t{4000}, size_t{0}, size_t{40}, size_t{100000}}) {
        std::vector<uint8_t> in(size + 1), out(size + 1, 0xA5);
        std::iota(in.begin(), in.end(), uint8_t{1});
        CHECK(stage.run({{in.data(), size}}, {{out.data(), size}}) == DEFREC_OK);
        CHECK(std::equal(in.begin(), in.end() - 1, out.begin()));
        CHECK(out.back() == 0xA5);
    }
}

TEST_CASE("a run before prepare is a state error") {
    const TestContext context({stub_folder("good").string()});
    TestStage stage(context, DEFREC_STAGE_RANSAC, small_ransac());
    uint8_t bytes[40] = {};
    CHECK(stage.run({{bytes, 40}}, {{bytes, 40}}) == DEFREC_ERROR_STATE);
    CHECK(contains(defrec_last_error(), "defrec_stage_prepare"));
}

TEST_CASE("a failure writes no output and carries the plugin's error message") {
    const TestContext context({stub_folder("good").string()});
    TestStage stage(context, DEFREC_STAGE_RANSAC, small_ransac());
    REQUIRE(stage.prepare() == DEFREC_OK);
    std::vector<uint8_t> in(40, 1), out(80, 0xA5);
    CHECK(stage.run({{in.data(), 40}}, {{out.data(), 80}}) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "one input and one output of the same size expected"));
    for (const uint8_t byte : out) CHECK(byte == 0xA5);
    defrec_ransac_params many = small_ransac();
    many.landmarks = 1001;
    defrec_stage refused = nullptr;
    CHECK(defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_RANSAC, &many, &refused) ==
          DEFREC_ERROR_UNSUPPORTED);
    CHECK(contains(defrec_last_error(), "at most 1000 landmarks"));
}

TEST_CASE("row 16: NULL and senseless buffers") {
    const TestContext context({stub_folder("good").string()});
    TestStage stage(context, DEFREC_STAGE_RANSAC, small_ransac());
    REQUIRE(stage.prepare() == DEFREC_OK);
    uint8_t bytes[64] = {};
    CHECK(defrec_stage_run(stage.get(), nullptr, 1, nullptr, 1) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_stage_run(stage.get(), nullptr, 0, nullptr, 0) == DEFREC_ERROR_ARGUMENT);
    CHECK(stage.run({{nullptr, 40}}, {{bytes, 40}}) == DEFREC_ERROR_ARGUMENT);
    CHECK(stage.run({{bytes, UINT64_MAX}}, {{bytes, 40}}) == DEFREC_ERROR_ARGUMENT);
    CHECK(stage.run(std::vector<defrec_const_buffer>(1000, {bytes, 1}), {{bytes, 40}}) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(stage.run({{bytes, 40}}, {{bytes + 8, 40}}) == DEFREC_OK);
}

TEST_CASE("row 46: a lost device says so ever after, and others go on") {
    const TestContext context({stub_folder("loses_device").string()});
    TestStage stage(context, DEFREC_STAGE_RANSAC, small_ransac());
    REQUIRE(stage.prepare() == DEFREC_OK);
    uint8_t bytes[40] = {};
    for (int i = 0; i < 2; ++i)
        CHECK(stage.run({{bytes, 40}}, {{bytes, 40}}) == DEFREC_ERROR_DEVICE_LOST);
    CHECK(contains(defrec_last_error(), "lost before"));
    TestStage fresh(context, DEFREC_STAGE_RANSAC, small_ransac());
    CHECK(fresh.prepare() == DEFREC_OK);
}

TEST_CASE(
    "row 39: a plugin that succeeds without a device, or never ends a wait, broke its contract") {
    const TestContext no_device({stub_folder("no_device").string()});
    const defrec_ransac_params params = small_ransac();
    defrec_stage stage = nullptr;
    CHECK(defrec_stage_create(no_device.get(), nullptr, DEFREC_STAGE_RANSAC, &params, &stage) ==
          DEFREC_ERROR_PLUGIN);
    const TestContext never({stub_folder("never_done").string()});
    TestStage waiting(never, DEFREC_STAGE_RANSAC, params);
    CHECK(waiting.prepare() == DEFREC_ERROR_PLUGIN);
}

TEST_CASE(
    "row 24: a buffer that is too small is named with the size needed, and guard bytes stay") {
    const TestContext context({reference()});
    TestStage stage(context, DEFREC_STAGE_RECTIFY, rectify_params());
    const size_t source_size = 65 * 49, needed = 80 * 48 + 65;
    std::vector<uint8_t> source(source_size, 100), gray(needed + 32, 0xA5), mask(needed + 32, 0xA5);
    CHECK(stage.run({{source.data(), source_size - 1}},
                    {{gray.data(), needed}, {mask.data(), needed}}) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "in[0] has 3184 bytes, 3185 are needed"));
    CHECK(stage.run({{source.data(), source_size}},
                    {{gray.data(), needed}, {mask.data(), needed - 1}}) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "out[1] has 3904 bytes, 3905 are needed"));
    for (const uint8_t byte : gray) REQUIRE(byte == 0xA5);
    CHECK(stage.run({{source.data(), source_size}},
                    {{gray.data(), needed}, {mask.data(), needed}}) == DEFREC_OK);
    for (size_t i = 0; i < gray.size(); ++i) {
        const bool inside = i < needed && i % 80 < 65;
        REQUIRE(gray[i] == (inside ? 100 : 0xA5));
        REQUIRE(mask[i] == (inside ? 255 : 0xA5));
    }
}

TEST_CASE("row 18: parameters are checked before a device sees them") {
    const TestContext context({reference()});
    defrec_stage stage = nullptr;
    const auto status_after = [&](auto change) {
        defrec_rectify_params params = rectify_params();
        change(params);
        return defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_RECTIFY, &params, &stage);
    };
    CHECK(status_after([](auto& p) { p.format = 9; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& p) { p.source_width = 0; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& p) { p.source_height = UINT32_MAX; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& p) { p.source_stride = 3; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& p) { p.stride = UINT32_MAX; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& p) { p.struct_size = 0; }) == DEFREC_ERROR_VERSION);
    CHECK(stage == nullptr);
    defrec_warp_params warp = small_warp();
    warp.camera.fx = 0;
    CHECK(defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_WARP, &warp, &stage) ==
          DEFREC_ERROR_ARGUMENT);
    warp = small_warp();
    warp.points = UINT32_MAX;
    CHECK(defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_WARP, &warp, &stage) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(stage == nullptr);
}

TEST_CASE("row 17: parameters that a shorter struct lacks have their defaults") {
    const TestContext context({reference()});
    defrec_align_params params;
    DEFREC_INIT(&params);
    params.width = 80;
    params.height = 60;
    params.camera = {500, 500, 40, 30, 4, 0};
    params.right_view = 2;  // behind the end of the shorter struct
    defrec_stage stage = nullptr;
    CHECK(defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_ALIGN, &params, &stage) ==
          DEFREC_ERROR_ARGUMENT);
    params.struct_size = offsetof(defrec_align_params, right_view);
    REQUIRE(defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_ALIGN, &params, &stage) ==
            DEFREC_OK);
    defrec_stage_destroy(stage);
}
