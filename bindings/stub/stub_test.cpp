// What the stub writes down and answers, as scripts/contract/writers/stub.py and stub.h promise.
#include "bindings/stub/stub.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <thread>

namespace {

template <typename Handle>
Handle handle(std::uintptr_t value) {
    return reinterpret_cast<Handle>(value);
}
std::string calls() { return defrec_stub_calls(); }

}  // namespace

TEST_CASE("arguments are written down as the header names and types them") {
    defrec_stub_reset();
    CHECK(defrec_job_wait(handle<defrec_job>(0x1003), UINT64_MAX) == DEFREC_OK);
    CHECK(calls() == "defrec_job_wait(job=0x1003, timeout_ns=18446744073709551615)\n");
    CHECK(calls().empty());

    defrec_orb_params params;
    DEFREC_INIT(&params);
    params.width = 0x1234;
    defrec_stage stage = nullptr;
    CHECK(defrec_stage_create(nullptr, "cpu", DEFREC_STAGE_ORB, &params, &stage) == DEFREC_OK);
    const std::string created = calls();
    CHECK(
        created.find("(context=NULL, device_id=\"cpu\", stage=2, params=2800000034120000000000") !=
        std::string::npos);
    char made[32];
    std::snprintf(made, sizeof made, ", out=%p)\n", static_cast<void*>(stage));
    CHECK(created.find(made) != std::string::npos);

    const defrec_const_buffer in[] = {{"abc", 3}, {nullptr, 0}};
    std::uint8_t bytes[] = {7, 7};
    const defrec_buffer out = {bytes, sizeof bytes};
    defrec_stage_run(handle<defrec_stage>(0x20), in, 2, &out, 1);
    CHECK(calls() ==
          "defrec_stage_run(stage=0x20, in=[3, NULL], in_count=2, out=[2], out_count=1)\n");
    CHECK(bytes[1] == 7);
}

TEST_CASE("points are written down, and outputs filled") {
    defrec_stub_reset();
    const double xyz[] = {1.5, -2, 0.25, 4, 5, 6};
    double moved[6] = {};
    std::uint8_t status[2] = {};
    CHECK(defrec_job_warp_points(nullptr, xyz, 2, moved, status, nullptr) == DEFREC_OK);
    CHECK(calls() ==
          "defrec_job_warp_points(job=NULL, template_xyz=[1.5, -2, 0.25, 4, 5, 6], count=2, "
          "xyz=written, "
          "status=written, expected_error_mm=NULL)\n");
    CHECK(moved[5] == 6);
    CHECK(status[1] == 2);

    defrec_device_info info;
    DEFREC_INIT(&info);
    info.memory_bytes = 9;
    CHECK(defrec_device_get(nullptr, 3, &info) == DEFREC_OK);
    CHECK(info.struct_size == sizeof info);
    CHECK(info.memory_bytes == 0);
    CHECK(std::string(info.driver) == "device driver");
}

TEST_CASE(
    "answers stay until reset; a failure writes no output and leaves its error message in its "
    "thread") {
    defrec_stub_reset();
    defrec_stub_answer("defrec_rig_create", DEFREC_ERROR_ARGUMENT,
                       "fx is -1; expected more than 0.");
    defrec_rig rig = handle<defrec_rig>(7);
    for (int i = 0; i < 2; ++i)
        CHECK(defrec_rig_create(nullptr, nullptr, &rig) == DEFREC_ERROR_ARGUMENT);
    CHECK(rig == handle<defrec_rig>(7));
    CHECK(calls().find("defrec_rig_create(context=NULL, desc=NULL, out=untouched)\n") == 0);
    CHECK(std::string(defrec_last_error()) == "fx is -1; expected more than 0.");
    std::thread([] { CHECK(std::string(defrec_last_error()).empty()); }).join();

    defrec_stub_answer("defrec_device_count", 5, nullptr);
    defrec_stub_answer("defrec_version", 2000, nullptr);
    defrec_stub_answer("defrec_version_string", 0, "2.0.0");
    CHECK(defrec_device_count(nullptr) == 5);
    CHECK(defrec_version() == 2000);
    CHECK(std::string(defrec_version_string()) == "2.0.0");

    defrec_stub_reset();
    CHECK(calls().empty());
    defrec_rig other = nullptr;
    CHECK(defrec_rig_create(nullptr, nullptr, &rig) == DEFREC_OK);
    CHECK(defrec_rig_create(nullptr, nullptr, &other) == DEFREC_OK);
    CHECK(rig != other);
    CHECK(defrec_version() == DEFREC_API_MAJOR * 1000 + DEFREC_API_MINOR);
}
