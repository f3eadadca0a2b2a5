// What a tracker's functions answer to bad frames and handles, with the reference backend and small
// images. Tracking itself: sdk/tracking/tracker_test.cpp.
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <thread>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_frames.hpp"

using namespace defrec::test;

namespace {

class TestTracker {
  public:
    explicit TestTracker(uint32_t in_flight = 2)
        : context_({std::string(DEFREC_BUILD_DIR) + "/lib/defrec_plugin_reference.json"}, 2) {
        const defrec_rig_desc rig = small_rig();
        REQUIRE(defrec_rig_create(context_.get(), &rig, &rig_) == DEFREC_OK);
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.format = DEFREC_FORMAT_GRAY8;
        desc.disparities = 16;
        desc.frames_in_flight = in_flight;
        const defrec_status status = defrec_tracker_create(context_.get(), rig_, &desc, &tracker_);
        INFO(defrec_last_error());
        REQUIRE(status == DEFREC_OK);
    }
    ~TestTracker() {
        defrec_tracker_destroy(tracker_);
        defrec_rig_destroy(rig_);
    }
    TestTracker(const TestTracker&) = delete;
    TestTracker& operator=(const TestTracker&) = delete;
    defrec_tracker get() const { return tracker_; }
    defrec_rig rig() const { return rig_; }
    defrec_context context() const { return context_.get(); }

    // Submits a good frame after the change; expects this status and leaves no job behind.
    void check_submit(defrec_status expected, const char* words,
                      const std::function<void(defrec_frame&, defrec_image&)>& change) {
        SmallFrame frame;
        frame.frame.timestamp_ns = ++time_;
        defrec_image changed = frame.image;
        frame.frame.left = &changed;
        change(frame.frame, changed);
        defrec_job job = nullptr;
        const defrec_status status = defrec_tracker_submit(tracker_, &frame.frame, &job);
        INFO(defrec_last_error());
        CHECK(status == expected);
        if (status < 0) {
            CHECK(job == nullptr);
            CHECK(contains(defrec_last_error(), words));
        }
        defrec_job_release(job);
    }
    int64_t next_time() { return ++time_; }

  private:
    TestContext context_;
    defrec_rig rig_ = nullptr;
    defrec_tracker tracker_ = nullptr;
    int64_t time_ = 0;
};

}  // namespace

TEST_CASE("rows 16 to 24: bad frames are refused with the reason, and the queue stays as it was") {
    TestTracker tracker;
    // More refusals than places in the queue.
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "left is NULL",
                         [](auto& f, auto&) { f.left = nullptr; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "right is NULL",
                         [](auto& f, auto&) { f.right = nullptr; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "pixels is NULL",
                         [](auto&, auto& i) { i.pixels = nullptr; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "unknown bits",
                         [](auto& f, auto&) { f.flags = 8; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "stride is 63",
                         [](auto&, auto& i) { i.stride = 63; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "stride",
                         [](auto&, auto& i) { i.stride = UINT64_MAX; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "unknown format",
                         [](auto&, auto& i) { i.format = 77; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "format 2 given",
                         [](auto&, auto& i) { i.format = DEFREC_FORMAT_BGR8, i.height = 48; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "expected",
                         [](auto&, auto& i) { i.width = i.height = 1; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "frame.field is 3",
                         [](auto& f, auto&) { f.field = 3; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "frame.reserved is 1, 0 expected",
                         [](auto& f, auto&) { f.reserved = 1; });
    tracker.check_submit(DEFREC_ERROR_VERSION, "struct_size",
                         [](auto& f, auto&) { f.struct_size = 0; });
    tracker.check_submit(DEFREC_ERROR_VERSION, "struct_size",
                         [](auto&, auto& i) { i.struct_size = 2; });
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "ignore", [](auto& f, auto& i) {
        static defrec_image ignore;
        ignore = i;
        ignore.width = 65;
        f.ignore = &ignore;
    });
    tracker.check_submit(DEFREC_OK, "", [](auto&, auto&) {});
    tracker.check_submit(DEFREC_OK, "", [](auto& f, auto& i) { f.ignore = &i; });
}

TEST_CASE("row 10: an image of another size than the rig's is refused, never scaled") {
    TestTracker tracker;
    std::vector<uint8_t> large(66 * 50);
    tracker.check_submit(DEFREC_ERROR_ARGUMENT, "66 x 50 pixels given, the rig has 64 x 48",
                         [&](auto&, auto& i) {
                             i.width = 66;
                             i.height = 50;
                             i.pixels = large.data();
                         });
}

TEST_CASE("row 28: frames submitted from several threads are queued whole, or the call is busy") {
    TestTracker tracker(16);
    std::atomic<int64_t> time{1};
    std::atomic<int> queued{0}, refused{0}, wrong{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t)
        threads.emplace_back([&] {
            SmallFrame frame;
            for (int i = 0; i < 10; ++i) {
                frame.frame.timestamp_ns = ++time;
                defrec_job job = nullptr;
                switch (defrec_tracker_submit(tracker.get(), &frame.frame, &job)) {
                    case DEFREC_OK:
                        ++queued;
                        break;
                    case DEFREC_ERROR_BUSY:      // another thread is inside
                    case DEFREC_ERROR_ARGUMENT:  // another thread's later timestamp came first
                        ++refused;
                        break;
                    default:
                        ++wrong;
                }
                if (job != nullptr && defrec_job_wait(job, UINT64_MAX) != DEFREC_OK) ++wrong;
                defrec_job_release(job);
            }
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(wrong == 0);
    CHECK(queued > 0);
    CHECK(queued + refused == 30);
}

TEST_CASE(
    "row 16: a released job is dead, and a result is written no further than the caller's struct") {
    TestTracker tracker;
    SmallFrame frame;
    frame.frame.timestamp_ns = tracker.next_time();
    defrec_job job = nullptr;
    REQUIRE(defrec_tracker_submit(tracker.get(), &frame.frame, &job) == DEFREC_OK);
    REQUIRE(defrec_job_wait(job, UINT64_MAX) == DEFREC_OK);
    struct {
        defrec_result result;
        unsigned char guard[64];
    } out;
    for (const uint32_t size : {uint32_t{12}, uint32_t(sizeof out.result), uint32_t(sizeof out)}) {
        std::memset(&out, 0xA5, sizeof out);
        out.result.struct_size = size;
        CHECK(defrec_job_result(job, &out.result) == DEFREC_OK);
        const auto* raw = reinterpret_cast<const unsigned char*>(&out);
        for (size_t i = std::min<size_t>(size, sizeof out.result); i < sizeof out; ++i)
            REQUIRE(raw[i] == 0xA5);
    }
    out.result.struct_size = 0;
    CHECK(defrec_job_result(job, &out.result) == DEFREC_ERROR_VERSION);
    CHECK(defrec_job_result(job, nullptr) == DEFREC_ERROR_ARGUMENT);
    double point[3] = {1, 2, 80};
    CHECK(defrec_job_warp_points(job, nullptr, 1, point, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_job_warp_points(job, point, SIZE_MAX, point, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    double covariance[6];
    CHECK(defrec_job_point_covariances(job, point, 1, covariance, nullptr) == DEFREC_ERROR_STATE);
    CHECK(defrec_job_point_covariances(job, nullptr, 1, covariance, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_job_point_covariances(job, point, 1, nullptr, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_job_point_covariances(job, point, SIZE_MAX, covariance, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    defrec_job_release(job);
    CHECK(defrec_job_wait(job, 0) == DEFREC_ERROR_HANDLE);
    CHECK(defrec_job_result(job, &out.result) == DEFREC_ERROR_HANDLE);
    CHECK(defrec_job_warp_points(job, point, 1, point, nullptr, nullptr) == DEFREC_ERROR_HANDLE);
}

TEST_CASE(
    "a tracker's destroyed handle is dead, its jobs are not, and everything may go in any order") {
    auto tracker = std::make_unique<TestTracker>();
    SmallFrame frame;
    frame.frame.timestamp_ns = 1;
    defrec_job job = nullptr;
    REQUIRE(defrec_tracker_submit(tracker->get(), &frame.frame, &job) == DEFREC_OK);
    REQUIRE(defrec_job_wait(job, UINT64_MAX) == DEFREC_OK);
    const defrec_tracker dead = tracker->get();
    tracker.reset();
    defrec_job other = nullptr;
    CHECK(defrec_tracker_submit(dead, &frame.frame, &other) == DEFREC_ERROR_HANDLE);
    CHECK(other == nullptr);
    defrec_result result;
    DEFREC_INIT(&result);
    CHECK(defrec_job_result(job, &result) == DEFREC_OK);
    CHECK(result.timestamp_ns == 1);
    defrec_job_release(job);
}

TEST_CASE("row 31: no thread of the library takes the application's signals") {
    const TestTracker tracker;
    int others = 0;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
        if (task.path().filename() == std::to_string(getpid())) continue;
        std::ifstream status(task.path() / "status");
        for (std::string line; std::getline(status, line);)
            if (line.starts_with("SigBlk:")) {
                const uint64_t blocked = std::stoull(line.substr(7), nullptr, 16);
                CHECK((blocked >> (SIGINT - 1) & 1) == 1);
                CHECK((blocked >> (SIGUSR1 - 1) & 1) == 1);
                ++others;
            }
    }
    CHECK(others >= 2);  // one of the pool, one of the tracker
}

TEST_CASE("row 18: descriptions of trackers out of range") {
    TestTracker tracker;
    defrec_tracker made = nullptr;
    const auto status_after = [&](auto change) {
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.format = DEFREC_FORMAT_GRAY8;
        change(desc);
        return defrec_tracker_create(tracker.context(), tracker.rig(), &desc, &made);
    };
    CHECK(status_after([](auto& d) { d.flags = 2; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) { d.format = 9; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) { d.frames_in_flight = 17; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) { d.device_id = "cuda:7"; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) { d.node_spacing_px = -1; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) {
              d.vertex_spacing_px = std::numeric_limits<float>::quiet_NaN();
          }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) { d.max_features = UINT32_MAX; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) { d.disparities = UINT32_MAX; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(made == nullptr);
}
