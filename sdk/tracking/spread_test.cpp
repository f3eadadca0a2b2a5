// Trackers spread over the devices of a backend: plugin several_devices has numbers 0 and 2, a
// broken number 1, and a number 3 that cannot track.
#include <doctest/doctest.h>

#include <map>
#include <string>
#include <thread>
#include <vector>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_frames.hpp"
#include "sdk/tracking/test_device.hpp"

using namespace defrec::test;

namespace {

constexpr char kSpread[] = "several_devices:*";

class Session {
  public:
    Session() : context({stub_folder("several_devices").string(), manifest_of("cpu")}, 2) {
        const defrec_rig_desc desc = small_rig();
        REQUIRE(defrec_rig_create(context.get(), &desc, &rig_) == DEFREC_OK);
    }
    ~Session() { defrec_rig_destroy(rig_); }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    defrec_status make(const char* device, defrec_tracker& tracker, uint32_t flags = 0) const {
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.device_id = device;
        desc.flags = flags;
        desc.format = DEFREC_FORMAT_GRAY8;
        desc.disparities = 16;
        return defrec_tracker_create(context.get(), rig_, &desc, &tracker);
    }
    defrec_tracker make(const char* device = kSpread) const {
        defrec_tracker tracker = nullptr;
        const defrec_status status = make(device, tracker);
        INFO(defrec_last_error());
        REQUIRE(status == DEFREC_OK);
        return tracker;
    }

    TestContext context;

  private:
    defrec_rig rig_ = nullptr;
};

// As the result of a frame names it.
std::string device_of(defrec_tracker tracker) {
    SmallFrame frame;
    defrec_job job = nullptr;
    REQUIRE(defrec_tracker_submit(tracker, &frame.frame, &job) == DEFREC_OK);
    REQUIRE(defrec_job_wait(job, UINT64_MAX) == DEFREC_OK);
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE(defrec_job_result(job, &result) == DEFREC_OK);
    const std::string id = result.device_id;
    defrec_job_release(job);
    return id;
}

}  // namespace

TEST_CASE(
    "each tracker goes to the device with the fewest, the first among several, past a broken "
    "one") {
    const Session session;
    std::vector<defrec_tracker> trackers;
    for (const char* device :
         {"several_devices:0", "several_devices:2", "several_devices:0", "several_devices:2"}) {
        trackers.push_back(session.make());
        CHECK(device_of(trackers.back()) == device);
    }
    // One of number 2 goes, then both of number 0.
    defrec_tracker_destroy(trackers[1]);
    trackers[1] = session.make();
    CHECK(device_of(trackers[1]) == "several_devices:2");
    defrec_tracker_destroy(trackers[0]);
    defrec_tracker_destroy(trackers[2]);
    trackers[0] = session.make();
    trackers[2] = session.make();
    CHECK(device_of(trackers[0]) == "several_devices:0");
    CHECK(device_of(trackers[2]) == "several_devices:0");
    // Those that were put on a device by its id count, too.
    trackers.push_back(session.make("several_devices:0"));
    trackers.push_back(session.make());
    CHECK(device_of(trackers.back()) == "several_devices:2");
    for (defrec_tracker tracker : trackers) defrec_tracker_destroy(tracker);
}

TEST_CASE("trackers made by several threads at once are spread evenly") {
    const Session session;
    std::vector<defrec_tracker> trackers(8);
    std::vector<defrec_status> made(trackers.size());
    std::vector<std::thread> threads;
    for (size_t i = 0; i < trackers.size(); ++i)
        threads.emplace_back([&, i] { made[i] = session.make(kSpread, trackers[i]); });
    for (std::thread& thread : threads) thread.join();
    std::map<std::string, int> on;
    for (size_t i = 0; i < trackers.size(); ++i) {
        REQUIRE(made[i] == DEFREC_OK);
        ++on[device_of(trackers[i])];
        defrec_tracker_destroy(trackers[i]);
    }
    CHECK(on["several_devices:0"] == 4);
    CHECK(on["several_devices:2"] == 4);
}

TEST_CASE(
    "a backend of one device is a spread of one; one of none and a broken device are refused") {
    const Session session;
    for (int i = 0; i < 2; ++i) {
        const defrec_tracker tracker = session.make("cpu:*");
        CHECK(device_of(tracker) == "cpu");
        defrec_tracker_destroy(tracker);
    }
    defrec_tracker tracker = nullptr;
    CHECK(session.make("cuda:*", tracker) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "\"cuda:*\"; there are: cpu, several_devices:0"));
    CHECK(session.make("*", tracker) == DEFREC_ERROR_ARGUMENT);
    CHECK(session.make("several_devices:1", tracker) == DEFREC_ERROR_DEVICE_LOST);
    CHECK(contains(defrec_last_error(), "this card is broken"));
    CHECK(session.make("several_devices:3", tracker) == DEFREC_ERROR_UNSUPPORTED);
}

TEST_CASE("a stage takes a device of the backend, too") {
    const Session session;
    const defrec_ransac_params params = small_ransac();
    defrec_stage stage = nullptr;
    CHECK(defrec_stage_create(session.context.get(), kSpread, DEFREC_STAGE_RANSAC, &params,
                              &stage) == DEFREC_OK);
    defrec_stage_destroy(stage);
}
