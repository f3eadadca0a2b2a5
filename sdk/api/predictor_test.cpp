// Points at the time of display through the C API: what is given, what is refused with which words.
// How near predictions are: sdk/predictor.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec::test;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int64_t kFrame = 33'333'333;  // ns

template <class Struct>
Struct init() {
    Struct made;
    DEFREC_INIT(&made);
    return made;
}

// Three points that swing, and the predictor that is told of them.
class Swinging {
  public:
    Swinging() {
        auto desc = init<defrec_predictor_desc>();
        desc.point_count = 3;
        REQUIRE_OK(defrec_predictor_create(&desc, &handle));
    }
    ~Swinging() { defrec_predictor_destroy(handle); }
    Swinging(const Swinging&) = delete;
    Swinging& operator=(const Swinging&) = delete;

    static double at(int64_t ns) { return 4 * std::sin(8 * 1e-9 * static_cast<double>(ns)); }
    defrec_predictor_frame frame(int64_t ns) {
        for (size_t i = 0; i < 3; ++i) {
            xyz[3 * i] = 10 * static_cast<double>(i);
            xyz[3 * i + 1] = at(ns);
            xyz[3 * i + 2] = 80;
        }
        auto made = init<defrec_predictor_frame>();
        made.state = DEFREC_TRACKING;
        made.epoch = 1;
        made.timestamp_ns = ns;
        made.xyz = xyz;
        made.status = status;
        made.expected_error_mm = error;
        made.count = 3;
        return made;
    }
    void add(int frames) {
        for (int i = 0; i < frames; ++i) {
            const defrec_predictor_frame each = frame(now += kFrame);
            REQUIRE_OK(defrec_predictor_add_frame(handle, &each));
        }
    }

    defrec_predictor handle = nullptr;
    int64_t now = 0;
    double xyz[9] = {}, error[3] = {0.1, 0.1, 0.1};
    uint8_t status[3] = {};
    double out[9] = {}, out_error[3] = {};
    uint8_t out_status[3] = {}, basis[3] = {};
};

}  // namespace

TEST_CASE("points at a time after the last frame, with status, error and basis") {
    Swinging points;
    points.add(60);
    points.status[1] = DEFREC_POINT_EXTRAPOLATED;
    points.add(1);
    REQUIRE_OK(defrec_predictor_predict(points.handle, points.now + 2 * kFrame, 3, points.out,
                                        points.out_status, points.out_error, points.basis));
    for (size_t i = 0; i < 3; ++i) {
        CHECK(points.out[3 * i] == doctest::Approx(10 * static_cast<double>(i)));
        CHECK(std::abs(points.out[3 * i + 1] - Swinging::at(points.now + 2 * kFrame)) < 0.02);
        CHECK(points.out_status[i] == points.status[i]);
        CHECK(points.out_error[i] >= 0.1);
        CHECK(points.basis[i] == DEFREC_PREDICTED_LEARNED);
    }
    double alone[9];
    REQUIRE_OK(defrec_predictor_predict(points.handle, points.now + 2 * kFrame, 3, alone, nullptr,
                                        nullptr, nullptr));
    for (size_t i = 0; i < 9; ++i) CHECK(alone[i] == points.out[i]);
}

TEST_CASE("row 208: frames that are lost, have no template, or whose state is not known") {
    for (const uint32_t state : {uint32_t{DEFREC_INITIALISING}, uint32_t{DEFREC_LOST}, 77u}) {
        CAPTURE(state);
        Swinging points;
        points.add(30);
        defrec_predictor_frame lost = points.frame(points.now += kFrame);
        lost.state = state;
        lost.xyz = lost.expected_error_mm = nullptr;
        lost.status = nullptr;
        REQUIRE_OK(defrec_predictor_add_frame(points.handle, &lost));
        REQUIRE_OK(defrec_predictor_predict(points.handle, points.now, 3, points.out,
                                            points.out_status, points.out_error, points.basis));
        CHECK(std::isnan(points.out[4]));
        CHECK(std::isnan(points.out_error[1]));
        CHECK(points.out_status[2] == DEFREC_POINT_UNKNOWN);
        CHECK(points.basis[2] == DEFREC_PREDICTED_LAST);
    }
    Swinging points;
    points.add(30);
    defrec_predictor_frame found = points.frame(points.now += kFrame);
    found.state = DEFREC_RELOCALISED;
    found.epoch = 2;
    found.expected_error_mm = nullptr;
    REQUIRE_OK(defrec_predictor_add_frame(points.handle, &found));
    REQUIRE_OK(defrec_predictor_predict(points.handle, points.now, 3, points.out, points.out_status,
                                        points.out_error, points.basis));
    CHECK(points.out[4] == points.xyz[4]);
    CHECK(points.out_error[1] == 0);
    CHECK(points.basis[1] == DEFREC_PREDICTED_LAST);
}

TEST_CASE("rows 204-205: a predictor's frames that are refused, with the reason") {
    using Frame = defrec_predictor_frame;
    const double not_finite[9] = {0, 0, 80, 0, kNaN, 80, 0, 0, 80};
    const double infinite[9] = {0, 0, 80, 0, 0, 80, HUGE_VAL, 0, 80};
    const double far[9] = {0, 0, 80, 0, 0, -1.1e6, 0, 0, 80};
    const double negative[3] = {0, 0, -0.5}, endless[3] = {0, HUGE_VAL, 0};
    const uint8_t strange[3] = {0, 1, 3};
    const std::vector<std::pair<std::function<void(Frame&)>, const char*>> cases = {
        {[](Frame& f) { f.count = 2; }, "frame.count is 2; the predictor has 3 points"},
        {[](Frame& f) { f.count = UINT64_MAX; }, "the predictor has 3 points"},
        {[](Frame& f) { f.xyz = nullptr; }, "frame.xyz is NULL"},
        {[](Frame& f) { f.status = nullptr; }, "frame.status is NULL"},
        {[&](Frame& f) { f.xyz = not_finite; }, "frame.xyz of point 1 has nan"},
        {[&](Frame& f) { f.xyz = infinite; }, "frame.xyz of point 2 has inf"},
        {[&](Frame& f) { f.xyz = far; }, "of point 1 has -1100000"},
        {[&](Frame& f) { f.expected_error_mm = negative; }, "of point 2 is -0.5"},
        {[&](Frame& f) { f.expected_error_mm = endless; }, "of point 1 is inf"},
        {[&](Frame& f) { f.status = strange; }, "frame.status of point 2 is 3"},
        {[](Frame& f) { f.timestamp_ns -= kFrame; }, "not after that of the frame before"},
        {[](Frame& f) { f.timestamp_ns = -5; }, "frame.timestamp_ns is -5"},
        {[](Frame& f) { f.reserved = 1; }, "frame.reserved is 1, 0 expected"},
    };
    Swinging points;
    points.add(40);
    REQUIRE_OK(defrec_predictor_predict(points.handle, points.now + kFrame, 3, points.out, nullptr,
                                        nullptr, nullptr));
    for (const auto& [change, said] : cases) {
        Frame frame = points.frame(points.now + kFrame);
        change(frame);
        CHECK(defrec_predictor_add_frame(points.handle, &frame) == DEFREC_ERROR_ARGUMENT);
        const std::string message = defrec_last_error();
        CHECK_MESSAGE(contains(message, said), message);
    }
    double again[9];
    REQUIRE_OK(defrec_predictor_predict(points.handle, points.now + kFrame, 3, again, nullptr,
                                        nullptr, nullptr));
    for (size_t i = 0; i < 9; ++i) CHECK(again[i] == points.out[i]);
    CHECK(defrec_predictor_add_frame(points.handle, nullptr) == DEFREC_ERROR_ARGUMENT);
    Frame old = points.frame(points.now + kFrame);
    old.struct_size = 0;
    CHECK(defrec_predictor_add_frame(points.handle, &old) == DEFREC_ERROR_VERSION);
}

TEST_CASE("row 204: a predictor that is refused, with the reason") {
    auto desc = init<defrec_predictor_desc>();
    defrec_predictor made = nullptr;
    CHECK(defrec_predictor_create(&desc, &made) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "desc.point_count is 0"));
    desc.point_count = 1'000'001;
    CHECK(defrec_predictor_create(&desc, &made) == DEFREC_ERROR_ARGUMENT);
    desc.point_count = 3;
    desc.flags = 1;
    CHECK(defrec_predictor_create(&desc, &made) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "desc.flags is 1"));
    desc.flags = 0;
    CHECK(defrec_predictor_create(&desc, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_predictor_create(nullptr, &made) == DEFREC_ERROR_ARGUMENT);
    CHECK(made == nullptr);
}

TEST_CASE("rows 206-207: times of display that are refused, with the reason") {
    Swinging points;
    const auto predict = [&](int64_t time, size_t count) {
        points.out[0] = -1;
        const defrec_status status = defrec_predictor_predict(
            points.handle, time, count, points.out, nullptr, nullptr, nullptr);
        if (status != DEFREC_OK) CHECK(points.out[0] == -1);
        return status;
    };
    CHECK(predict(0, 3) == DEFREC_ERROR_STATE);
    CHECK(contains(defrec_last_error(), "no frame yet"));
    points.add(5);
    CHECK(predict(points.now, 3) == DEFREC_OK);
    CHECK(predict(points.now + 100'000'000, 3) == DEFREC_OK);
    CHECK(predict(points.now + 100'000'001, 3) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "expected at most 100 ms"));
    CHECK(predict(points.now - 1, 3) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "before the last frame"));
    CHECK(predict(INT64_MAX, 3) == DEFREC_ERROR_ARGUMENT);
    CHECK(predict(INT64_MIN, 3) == DEFREC_ERROR_ARGUMENT);
    CHECK(predict(points.now, 4) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "count is 4; the predictor has 3 points"));
    CHECK(defrec_predictor_predict(points.handle, points.now, 3, nullptr, nullptr, nullptr,
                                   nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "xyz is NULL"));
}

TEST_CASE("row 16: a predictor's handle: NULL, destroyed, foreign") {
    auto desc = init<defrec_predictor_desc>();
    desc.point_count = 1;
    defrec_predictor predictor = nullptr;
    REQUIRE_OK(defrec_predictor_create(&desc, &predictor));
    auto info = init<defrec_plan_info>();
    CHECK(defrec_plan_get(reinterpret_cast<defrec_plan>(predictor), &info) == DEFREC_ERROR_HANDLE);
    CHECK(contains(defrec_last_error(), "a predictor handle was given"));
    auto frame = init<defrec_predictor_frame>();
    frame.count = 1;
    double xyz[3];
    CHECK(defrec_predictor_add_frame(nullptr, &frame) == DEFREC_ERROR_ARGUMENT);
    defrec_predictor_destroy(predictor);
    defrec_predictor_destroy(predictor);
    CHECK(contains(defrec_last_error(), "destroyed already"));
    defrec_predictor_destroy(nullptr);
    CHECK(defrec_predictor_add_frame(predictor, &frame) == DEFREC_ERROR_HANDLE);
    CHECK(defrec_predictor_predict(predictor, 0, 1, xyz, nullptr, nullptr, nullptr) ==
          DEFREC_ERROR_HANDLE);
}

TEST_CASE("frames are added while another thread asks") {
    constexpr int kFrames = 200;
    Swinging points;
    points.add(2);
    const int64_t first = points.now;
    std::thread adding([&] { points.add(kFrames); });
    double xyz[9];
    const auto ask = [&](int64_t time) {
        return defrec_predictor_predict(points.handle, time, 3, xyz, nullptr, nullptr, nullptr);
    };
    for (int64_t time = first; time <= first + kFrames * kFrame; time += kFrame / 10) {
        const defrec_status status = ask(time);  // the adding thread may be far ahead, or behind
        CHECK((status == DEFREC_OK || status == DEFREC_ERROR_ARGUMENT));
        if (status == DEFREC_OK) CHECK(xyz[2] == doctest::Approx(80));
    }
    adding.join();
    REQUIRE_OK(ask(points.now));
    CHECK(xyz[4] == doctest::Approx(Swinging::at(points.now)));
}
