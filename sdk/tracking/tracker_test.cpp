// The tracker through the C API, on a textured plane that is moved: states, reasons, queue,
// templates, repeatability. Faults of the stream: stream_faults_test.cpp.
#include <doctest/doctest.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "sdk/tracking/test_pair_session.hpp"

using namespace defrec::test;
using Session = PairSession;

namespace {

bool all_unknown(const Session::Frame& frame) {
    return std::all_of(frame.status.begin(), frame.status.end(),
                       [](uint8_t status) { return status == DEFREC_POINT_UNKNOWN; });
}

// Something smooth and gray, 40 mm from the cameras, before the left `share` of the image.
Pair covered(Pair pair, double share) {
    const int shift = static_cast<int>(std::lround(kFocal * kBaseline / 40));
    const int edge = static_cast<int>(std::lround(share * (kWidth + shift)));
    for (int view = 0; view < 2; ++view)
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < std::min(kWidth, edge - view * shift); ++x)
                (view == 0 ? pair.left : pair.right)[static_cast<size_t>(y * kWidth + x)] =
                    static_cast<uint8_t>(
                        110 + std::lround(30 * smooth_noise(0.2 * (x + view * shift), 0.2 * y, 9)));
    return pair;
}

// In the frame after those that were lost.
void check_found_again(const Session::Frame& frame, uint32_t epoch_before, double shift) {
    CHECK(frame.state == DEFREC_RELOCALISED);
    CHECK((frame.reasons & DEFREC_REASON_VIEWS_SWAPPED) == 0);
    CHECK(frame.epoch == epoch_before + 1);
    CHECK(frame.age == 0);
    CHECK(std::abs(frame.shift[0] - shift) < 0.3);
}

}  // namespace

TEST_CASE("the first frame gives the template, and a moving surface is followed") {
    Session session;
    const Session::Frame first = session.track(render(0, 0));
    CHECK(first.state == DEFREC_TRACKING);
    CHECK(first.epoch == 1);
    for (const double shift : first.shift) CHECK(std::abs(shift) < 0.1);
    for (int i = 1; i <= 6; ++i) {
        const Session::Frame frame = session.track(render(0.7 * i, -0.4 * i));
        CAPTURE(i);
        CHECK(frame.state == DEFREC_TRACKING);
        CHECK(std::abs(frame.shift[0] - 0.7 * i) < 0.15);
        CHECK(std::abs(frame.shift[1] + 0.4 * i) < 0.15);
    }
}

TEST_CASE(
    "row 64: a sudden shift of ten millimetres between two frames is found in the same frame") {
    Session session;
    session.track(render(0, 0));
    const Session::Frame frame = session.track(render(10, 3));
    CHECK(usable(frame.state));
    CHECK((frame.reasons & DEFREC_REASON_FAST_MOTION) != 0);
    CHECK(std::abs(frame.shift[0] - 10) < 0.3);
    CHECK(std::abs(frame.shift[1] - 3) < 0.3);
}

TEST_CASE("row 64: other tissue from one frame to the next is lost at once, and leaves no drift") {
    Session session;
    session.track(render(0, 0));
    const uint32_t epoch = session.track(render(0.5, 0)).epoch;
    for (int i = 0; i < 3; ++i) {
        CAPTURE(i);
        const Session::Frame frame = session.track(render(500 + 0.3 * i, -700));
        CHECK(frame.state == DEFREC_LOST);
        CHECK(frame.epoch == epoch);
        CHECK(all_unknown(frame));
        CHECK(std::abs(frame.shift[0] - 0.5) < 0.15);  // the last known
    }
    check_found_again(session.track(render(0.7, 0)), epoch, 0.7);
}

TEST_CASE(
    "row 59: an instrument before a part of the surface degrades; before all of it the last "
    "surface is kept with its age, and nothing of it counts as observed") {
    Session session;
    session.track(render(0, 0));
    session.track(render(0.2, 0));
    const Session::Frame half = session.track(covered(render(0.4, 0), 0.45));
    CHECK(half.state == DEFREC_DEGRADED);
    CHECK((half.reasons & DEFREC_REASON_OCCLUDED) != 0);
    const auto count = [](const Session::Frame& frame, uint8_t status) {
        return std::count(frame.status.begin(), frame.status.end(), status);
    };
    CHECK(count(half, DEFREC_POINT_OBSERVED) > 0);
    CHECK(count(half, DEFREC_POINT_OBSERVED) < 0.65 * static_cast<double>(half.status.size()));
    CHECK(std::abs(half.shift[0] - 0.4) < 0.5);
    float error = 0;
    for (uint32_t age = 1; age <= 3; ++age) {
        CAPTURE(age);
        const Session::Frame all = session.track(covered(render(0.4, 0), 1));
        CHECK(all.state == DEFREC_LOST);
        CHECK(all.age == age);
        CHECK(count(all, DEFREC_POINT_UNKNOWN) == static_cast<std::ptrdiff_t>(all.status.size()));
        CHECK(all.vertices == half.vertices);
        CHECK(all.largest_error > error);
        error = all.largest_error;
    }
    check_found_again(session.track(render(0.6, 0)), half.epoch, 0.6);
}

TEST_CASE(
    "rows 58 and 63: black frames are lost at once, and the surface is found again when it "
    "returns") {
    Session session;
    session.track(render(0, 0));
    const uint32_t epoch = session.track(render(0.5, 0)).epoch;
    Pair black;
    for (int i = 0; i < 3; ++i) {
        const Session::Frame frame = session.track(black);
        CHECK(frame.state == DEFREC_LOST);
        CHECK((frame.reasons & DEFREC_REASON_DARK) != 0);
        CHECK(all_unknown(frame));
    }
    check_found_again(session.track(render(4, 2)), epoch, 4);
    CHECK(session.track(render(4, 2, 1, 5)).state == DEFREC_TRACKING);
}

TEST_CASE("row 58: white frames are lost and say why") {
    Session session;
    session.track(render(0, 0));
    Pair white;
    std::fill(white.left.begin(), white.left.end(), uint8_t{255});
    white.right = white.left;
    const Session::Frame frame = session.track(white);
    CHECK(frame.state == DEFREC_LOST);
    CHECK((frame.reasons & DEFREC_REASON_SATURATED) != 0);
}

TEST_CASE("row 62: a surface without texture is never a template") {
    Session session;
    Pair gray;
    std::fill(gray.left.begin(), gray.left.end(), uint8_t{120});
    gray.right = gray.left;
    const Session::Frame frame = session.track(gray);
    CHECK(frame.state == DEFREC_INITIALISING);
    CHECK((frame.reasons & (DEFREC_REASON_NO_TEXTURE | DEFREC_REASON_NO_DEPTH)) != 0);
    CHECK(frame.vertices.empty());
}

TEST_CASE(
    "row 67: while the right view is dark, white or covered the left one alone is followed, and no "
    "depth is observed") {
    for (const int gray : {0, 255, 120}) {
        CAPTURE(gray);
        Session session;
        session.track(render(0, 0));
        const uint32_t epoch = session.track(render(0.5, 0)).epoch;
        for (int i = 1; i <= 12; ++i) {
            CAPTURE(i);
            Pair half = render(0.5 + 0.4 * i, -0.3 * i);
            std::fill(half.right.begin(), half.right.end(), static_cast<uint8_t>(gray));
            const Session::Frame frame = session.track(half);
            CHECK(frame.state == DEFREC_DEGRADED);
            CHECK((frame.reasons & DEFREC_REASON_ONE_VIEW) != 0);
            CHECK(std::count(frame.status.begin(), frame.status.end(), DEFREC_POINT_OBSERVED) == 0);
            CHECK_FALSE(all_unknown(frame));
            CHECK(std::abs(frame.shift[0] - 0.5 - 0.4 * i) < 0.2);
            CHECK(std::abs(frame.shift[1] + 0.3 * i) < 0.2);
        }
        const Session::Frame back = session.track(render(5.6, -3.9));
        CHECK(back.state == DEFREC_TRACKING);
        CHECK(back.epoch == epoch);
        CHECK(std::abs(back.shift[0] - 5.6) < 0.15);
    }
}

TEST_CASE("row 67: a dark left view is lost, with the view as the reason") {
    Session session;
    session.track(render(0, 0));
    Pair half = render(0.2, 0);
    std::fill(half.left.begin(), half.left.end(), uint8_t{0});
    const Session::Frame frame = session.track(half);
    CHECK(frame.state == DEFREC_LOST);
    CHECK((frame.reasons & DEFREC_REASON_ONE_VIEW) != 0);
}

TEST_CASE("row 67: a right view that is dark gives no template") {
    Session session;
    Pair half = render(0, 0);
    std::fill(half.right.begin(), half.right.end(), uint8_t{0});
    const Session::Frame frame = session.track(half);
    CHECK(frame.state == DEFREC_INITIALISING);
    CHECK((frame.reasons & DEFREC_REASON_ONE_VIEW) != 0);
    CHECK(session.track(render(0.3, 0)).state == DEFREC_TRACKING);
}

TEST_CASE("row 6: exchanged views are named while there is no template") {
    Session session;
    Pair pair = render(0, 0);
    std::swap(pair.left, pair.right);
    const Session::Frame frame = session.track(pair);
    CHECK(frame.state == DEFREC_INITIALISING);
    CHECK((frame.reasons & DEFREC_REASON_VIEWS_SWAPPED) != 0);
}

TEST_CASE("row 6: views that are exchanged while the surface is followed lose it, and are named") {
    Session session;
    session.track(render(0, 0));
    const uint32_t epoch = session.track(render(0.3, 0)).epoch;
    for (int i = 0; i < 3; ++i) {
        CAPTURE(i);
        Pair pair = render(0.3 + 0.1 * i, 0);
        std::swap(pair.left, pair.right);
        const Session::Frame frame = session.track(pair);
        CHECK(frame.state == DEFREC_LOST);
        CHECK((frame.reasons & DEFREC_REASON_VIEWS_SWAPPED) != 0);
        CHECK(all_unknown(frame));
    }
    check_found_again(session.track(render(0.6, 0)), epoch, 0.6);
}

TEST_CASE("row 106: a right view that slips sideways is out of calibration until it is back") {
    const auto slipped = [](Pair pair, int px) {
        for (int y = 0; y < kHeight; ++y) {
            uint8_t* row = &pair.right[static_cast<size_t>(y * kWidth)];
            std::rotate(row, row + px, row + kWidth);
        }
        return pair;
    };
    for (const int px : {2, 6}) {
        CAPTURE(px);
        Session session;
        for (int i = 0; i < 3; ++i)
            CHECK(session.track(render(0.3 * i, 0)).state == DEFREC_TRACKING);
        for (int i = 3; i < 6; ++i) {
            CAPTURE(i);
            const Session::Frame frame = session.track(slipped(render(0.3 * i, 0), px));
            CHECK(std::count(frame.status.begin(), frame.status.end(), DEFREC_POINT_OBSERVED) == 0);
            if (i < 5) continue;  // after a large slip, depth needs some frames to be found again
            CHECK(frame.state == DEFREC_DEGRADED);
            CHECK((frame.reasons & DEFREC_REASON_CALIBRATION) != 0);
            // The slip is known to about a tenth.
            CHECK(frame.largest_error > 0.9 * std::abs(frame.shift[2]));
        }
        session.track(render(1.8, 0));
        session.track(render(1.8, 0.1));
        const Session::Frame back = session.track(render(1.8, 0.2));
        CHECK(back.state == DEFREC_TRACKING);
        CHECK((back.reasons & DEFREC_REASON_CALIBRATION) == 0);
    }
}

TEST_CASE("row 70: a long static run with noise neither moves nor drifts") {
    Session session;
    session.track(render(0, 0, 2, 1));
    for (uint64_t i = 0; i < 40; ++i) {
        const Session::Frame frame = session.track(render(0, 0, 2, 100 + i));
        CAPTURE(i);
        CHECK(frame.state == DEFREC_TRACKING);
        for (const double shift : frame.shift) CHECK(std::abs(shift) < 0.12);
    }
}

TEST_CASE(
    "a full queue is an error, not a dropped frame; jobs end in order; results stay until "
    "released") {
    Session session;
    const Pair pair = render(0, 0);
    defrec_job first = nullptr, second = nullptr, third = nullptr;
    REQUIRE_OK(session.submit(pair, &first));
    REQUIRE_OK(session.submit(render(0.3, 0), &second));
    CHECK(session.submit(pair, &third) == DEFREC_ERROR_BUSY);
    REQUIRE_OK(defrec_job_wait(second, UINT64_MAX));
    CHECK(defrec_job_wait(first, 0) == DEFREC_OK);
    defrec_result one, two;
    DEFREC_INIT(&one);
    DEFREC_INIT(&two);
    REQUIRE_OK(defrec_job_result(first, &one));
    REQUIRE_OK(defrec_job_result(second, &two));
    CHECK(one.frame + 1 == two.frame);
    CHECK(one.vertices != two.vertices);
    defrec_job_release(first);
    REQUIRE_OK(session.submit(pair, &third));
    defrec_job_release(second);
    defrec_job_release(third);
}

TEST_CASE("row 29: destroying a tracker with frames queued ends them, and their jobs stay valid") {
    Session session;
    defrec_job first = nullptr, second = nullptr;
    REQUIRE_OK(session.submit(render(0, 0), &first));
    REQUIRE_OK(session.submit(render(0.1, 0), &second));
    defrec_tracker_destroy(session.tracker);
    session.tracker = nullptr;
    for (defrec_job job : {first, second}) {
        const defrec_status status = defrec_job_wait(job, UINT64_MAX);
        CHECK((status == DEFREC_OK || status == DEFREC_ERROR_STATE));
        defrec_job_release(job);
    }
}

TEST_CASE("a point that is not finite is unknown, and the points beside it are none the worse") {
    Session session;
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit(render(0, 0), &job));
    REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                     kInfinity = std::numeric_limits<double>::infinity();
    const double centre[3] = {0, 0, kDepth};
    for (const double bad : {kNaN, kInfinity, -kInfinity})
        for (int axis = 0; axis < 3; ++axis) {
            double points[6] = {0, 0, kDepth, 0, 0, kDepth}, error[2], covariances[12];
            uint8_t status[2], evidence[2];
            points[axis] = bad;
            REQUIRE_OK(defrec_job_point_covariances(job, points, 2, covariances, evidence));
            REQUIRE_OK(defrec_job_warp_points(job, points, 2, points, status, error));
            for (int i = 0; i < 6; ++i) CHECK(std::isnan(covariances[i]));
            CHECK(evidence[0] == 0);
            CHECK((evidence[1] & DEFREC_EVIDENCE_DEPTH) != 0);
            CHECK(std::sqrt(covariances[6] + covariances[9] + covariances[11]) ==
                  doctest::Approx(error[1]));
            for (int i = 0; i < 3; ++i) {
                CHECK(std::isnan(points[i]));
                CHECK(std::abs(points[3 + i] - centre[i]) < 0.1);
            }
            CHECK(status[0] == DEFREC_POINT_UNKNOWN);
            CHECK(status[1] == DEFREC_POINT_OBSERVED);
        }
    const double far[3] = {1e300, 0, 1e-300};
    double moved[3];
    uint8_t status = 0;
    REQUIRE_OK(defrec_job_warp_points(job, far, 1, moved, &status, nullptr));
    CHECK(status == DEFREC_POINT_UNKNOWN);
    defrec_job_release(job);
}

TEST_CASE("a template can be saved, loaded and tracked by another tracker") {
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / "defrec_tracker_test_template";
    {
        Session session;
        session.track(render(0, 0));
        defrec_template surface = nullptr;
        REQUIRE_OK(defrec_tracker_get_template(session.tracker, &surface));
        REQUIRE_OK(defrec_template_save(surface, path.c_str()));
        defrec_template_release(surface);
    }
    Session session;
    defrec_template surface = nullptr;
    CHECK(defrec_tracker_get_template(session.tracker, &surface) == DEFREC_ERROR_STATE);
    REQUIRE_OK(defrec_template_load(session.context, path.c_str(), &surface));
    REQUIRE_OK(defrec_tracker_set_template(session.tracker, surface));
    defrec_template_release(surface);
    const Session::Frame frame = session.track(render(2, 1));
    CHECK(frame.state == DEFREC_RELOCALISED);
    CHECK(std::abs(frame.shift[0] - 2) < 0.2);
    std::filesystem::remove(path);
}

TEST_CASE("a template of another camera is refused") {
    Session session;
    session.track(render(0, 0));
    defrec_template surface = nullptr;
    REQUIRE_OK(defrec_tracker_get_template(session.tracker, &surface));
    const auto try_on = [&](const TrackingSession::Change& change) {
        TrackingSession other("cpu", 2, change);
        return defrec_tracker_set_template(other.tracker, surface);
    };
    CHECK(try_on(nullptr) == DEFREC_OK);
    for (double defrec_intrinsics::*member : {&defrec_intrinsics::fx, &defrec_intrinsics::fy,
                                              &defrec_intrinsics::cx, &defrec_intrinsics::cy}) {
        const auto change = [member](defrec_rig_desc& rig, defrec_tracker_desc&) {
            rig.left.*member += 0.5;
            rig.right.*member += 0.5;
        };
        CHECK(try_on(change) == DEFREC_ERROR_ARGUMENT);
        CHECK(std::string(defrec_last_error()).find("the rig has fx") != std::string::npos);
    }
    CHECK(try_on([](defrec_rig_desc& rig, defrec_tracker_desc&) { rig.translation[0] *= 1.01; }) ==
          DEFREC_ERROR_ARGUMENT);
    defrec_template_release(surface);
}

TEST_CASE("a template is captured anew on request") {
    Session session;
    const uint32_t epoch = session.track(render(0, 0)).epoch;
    session.track(render(3, 0));
    const Session::Frame frame =
        session.track(render(3, 0, 1, 3), nullptr, DEFREC_FRAME_CAPTURE_TEMPLATE);
    CHECK(frame.epoch == epoch + 1);
    CHECK(std::abs(frame.shift[0]) < 0.15);
}

TEST_CASE("a template that was set stays where a frame that is to be captured shows too little") {
    Session session;
    session.track(render(0, 0));
    defrec_template surface = nullptr, followed = nullptr;
    REQUIRE_OK(defrec_tracker_get_template(session.tracker, &surface));
    session.track(render(0, 0, 1, 3), nullptr, DEFREC_FRAME_CAPTURE_TEMPLATE);
    REQUIRE_OK(defrec_tracker_set_template(session.tracker, surface));
    const Pair white{std::vector<uint8_t>(kWidth * kHeight, 255),
                     std::vector<uint8_t>(kWidth * kHeight, 255)};
    session.track(white, nullptr, DEFREC_FRAME_CAPTURE_TEMPLATE);
    const Session::Frame frame = session.track(render(1, 0));
    CHECK(frame.state == DEFREC_RELOCALISED);
    CHECK(std::abs(frame.shift[0] - 1) < 0.2);
    REQUIRE_OK(defrec_tracker_get_template(session.tracker, &followed));
    defrec_template_release(followed);
    defrec_template_release(surface);
}

TEST_CASE("ignored pixels give no features and no patches") {
    Session whole, half;
    std::vector<uint8_t> ignore(kWidth * kHeight);
    for (size_t y = 0; y < kHeight; ++y)
        for (size_t x = kWidth / 2; x < kWidth; ++x) ignore[y * kWidth + x] = 1;
    const Session::Frame all = whole.track(render(0, 0)), left = half.track(render(0, 0), &ignore);
    CHECK(left.features < all.features);
    CHECK(left.patches < 0.7 * all.patches);
    CHECK(left.patches > 0);
}

TEST_CASE("two runs, and one or three threads, give the same bits") {
    Session a("cpu", 1), b("cpu", 3), c("cpu", 3);
    for (int i = 0; i < 4; ++i) {
        const Pair pair = render(0.6 * i, 0.2 * i, 2, static_cast<uint64_t>(i));
        const Session::Frame one = a.track(pair), two = b.track(pair), three = c.track(pair);
        CHECK(one.vertices == two.vertices);
        CHECK(two.vertices == three.vertices);
        CHECK(one.status == two.status);
    }
}

TEST_CASE("the reference backend follows the same surface to the same place") {
    Session cpu("cpu"), reference("reference");
    for (int i = 0; i < 2; ++i) {
        const Pair pair = render(1.5 * i, 0);
        const Session::Frame fast = cpu.track(pair), plain = reference.track(pair);
        CHECK(plain.state == fast.state);
        for (int axis = 0; axis < 3; ++axis)
            CHECK(std::abs(fast.shift[axis] - plain.shift[axis]) < 0.02);
    }
}

namespace {

// Every value nearer to the mean, or averaged over a square of this radius.
std::vector<uint8_t> faint(std::vector<uint8_t> image, double contrast) {
    for (uint8_t& value : image)
        value = static_cast<uint8_t>(std::lround(125 + contrast * (value - 125)));
    return image;
}
std::vector<uint8_t> blurred(const std::vector<uint8_t>& image, int radius) {
    std::vector<uint8_t> result = image;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            int sum = 0, count = 0;
            for (int v = std::max(0, y - radius); v <= std::min(kHeight - 1, y + radius); ++v)
                for (int u = std::max(0, x - radius); u <= std::min(kWidth - 1, x + radius); ++u) {
                    sum += image[static_cast<size_t>(v * kWidth + u)];
                    ++count;
                }
            result[static_cast<size_t>(y * kWidth + x)] = static_cast<uint8_t>(sum / count);
        }
    return result;
}

}  // namespace

TEST_CASE("row 77: texture too faint for features is followed by patches and depth") {
    constexpr double kContrast = 0.045;
    Session session;
    const auto track = [&](double dx) {
        Pair pair = render(dx, 0);
        pair.left = faint(pair.left, kContrast);
        pair.right = faint(pair.right, kContrast);
        return session.track(pair);
    };
    const Session::Frame first = track(0);
    CHECK(first.features == 0);
    CHECK(first.state != DEFREC_INITIALISING);
    const Session::Frame second = track(0.2);
    CHECK(second.state != DEFREC_INITIALISING);
    if (usable(second.state)) CHECK(std::abs(second.shift[0] - 0.2) < 0.15);
}

// Searches near where the surface was would find it up to 16 px away.
TEST_CASE("without features, a jump by more than a search is wide is followed by a wide search") {
    constexpr double kContrast = 0.07, kJump = 4.7;  // mm, 20 px
    Session session;
    const auto track = [&](double dx) {
        Pair pair = render(dx, 0);
        pair.left = faint(pair.left, kContrast);
        pair.right = faint(pair.right, kContrast);
        return session.track(pair);
    };
    CHECK(track(0).features < 20);
    const Session::Frame second = track(kJump);
    CHECK(second.state == DEFREC_DEGRADED);
    CHECK((second.reasons & DEFREC_REASON_LOW_CONTRAST) != 0);
    CHECK(std::abs(second.shift[0] - kJump) < 0.15);
}

TEST_CASE("row 65: a blurred image is degraded or lost, and a sharp one is followed again") {
    Session session;
    session.track(render(0, 0));
    Pair pair = render(0.2, 0);
    pair.left = blurred(pair.left, 6);
    pair.right = blurred(pair.right, 6);
    const Session::Frame frame = session.track(pair);
    CHECK((frame.state == DEFREC_DEGRADED || frame.state == DEFREC_LOST));
    CHECK(frame.reasons != 0);
    CHECK(usable(session.track(render(0.3, 0)).state));
}

TEST_CASE("row 69: where everything moves as one, as when the camera does, nothing deforms") {
    Session session;
    const Session::Frame first = session.track(render(0, 0));
    for (int i = 1; i <= 4; ++i) {
        const Session::Frame frame = session.track(render(0.5 * i, 0.3 * i));
        REQUIRE(frame.vertices.size() == first.vertices.size());
        double mean[3] = {0, 0, 0}, squares = 0;
        size_t count = 0;
        const auto shift = [&](size_t vertex, size_t axis) {
            return static_cast<double>(frame.vertices[3 * vertex + axis]) -
                   first.vertices[3 * vertex + axis];
        };
        for (size_t k = 0; k < frame.status.size(); ++k) {
            if (frame.status[k] != DEFREC_POINT_OBSERVED) continue;
            ++count;
            for (size_t axis = 0; axis < 3; ++axis) mean[axis] += shift(k, axis);
        }
        REQUIRE(count > frame.status.size() / 2);
        for (double& value : mean) value /= static_cast<double>(count);
        for (size_t k = 0; k < frame.status.size(); ++k)
            if (frame.status[k] == DEFREC_POINT_OBSERVED)
                for (size_t axis = 0; axis < 2; ++axis)
                    squares += std::pow(shift(k, axis) - mean[axis], 2);
        CAPTURE(i);
        CHECK(std::sqrt(squares / static_cast<double>(count)) < 0.15);
    }
}

TEST_CASE("row 88: spacings that would make a template of minutes and gigabytes are refused") {
    const auto refusal = [](uint32_t width, uint32_t height, float vertices, float nodes) {
        std::string text;
        Session session("cpu", 2, [&](defrec_rig_desc&, defrec_tracker_desc&) {});
        defrec_rig_desc rig_desc;
        DEFREC_INIT(&rig_desc);
        rig_desc.width = width;
        rig_desc.height = height;
        rig_desc.left = {1000, 1000, width / 2.0, height / 2.0, {}, 0, 0};
        rig_desc.right = rig_desc.left;
        rig_desc.rotation[0] = rig_desc.rotation[4] = rig_desc.rotation[8] = 1;
        rig_desc.translation[0] = -5;
        defrec_rig rig = nullptr;
        REQUIRE(defrec_rig_create(session.context, &rig_desc, &rig) == DEFREC_OK);
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.device_id = "cpu";
        desc.vertex_spacing_px = vertices;
        desc.node_spacing_px = nodes;
        defrec_tracker tracker = nullptr;
        const defrec_status status = defrec_tracker_create(session.context, rig, &desc, &tracker);
        if (status == DEFREC_ERROR_ARGUMENT) text = defrec_last_error();
        CHECK((status == DEFREC_OK || status == DEFREC_ERROR_ARGUMENT));
        defrec_tracker_destroy(tracker);
        defrec_rig_destroy(rig);
        return text;
    };
    CHECK(refusal(1920, 1080, 1, 0).find("vertex_spacing_px is 1 px") != std::string::npos);
    CHECK(refusal(1920, 1080, 0, 4).find("node_spacing_px is 4 px") != std::string::npos);
    CHECK(refusal(320, 240, 1, 4).empty());  // of small images they are possible
    CHECK(refusal(1920, 1080, 4, 16).empty());
}

TEST_CASE("row 101: threads of 64 KiB of stack may call everything") {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    constexpr size_t kStack = 1 << 20;  // a sanitizer's frames are larger
#else
    constexpr size_t kStack = 64 << 10;
#endif
    const Pair pair = render(0, 0);
    const auto body = [](void* given) -> void* {
        const auto& frame = *static_cast<const Pair*>(given);
        const auto session = std::make_unique<Session>();
        const Session::Frame tracked = session->track(frame);
        CHECK(tracked.state == DEFREC_TRACKING);
        defrec_template surface = nullptr;
        REQUIRE_OK(defrec_tracker_get_template(session->tracker, &surface));
        const std::string path = std::filesystem::temp_directory_path() /
                                 ("defrec-small-stack-" + std::to_string(getpid()));
        REQUIRE_OK(defrec_template_save(surface, path.c_str()));
        defrec_template_release(surface);
        REQUIRE_OK(defrec_template_load(session->context, path.c_str(), &surface));
        std::filesystem::remove(path);
        REQUIRE_OK(defrec_tracker_set_template(session->tracker, surface));
        defrec_template_release(surface);
        CHECK(session->track(frame).state == DEFREC_RELOCALISED);
        return nullptr;
    };
    pthread_attr_t attributes;
    REQUIRE(pthread_attr_init(&attributes) == 0);
    const auto least = static_cast<size_t>(sysconf(_SC_THREAD_STACK_MIN));
    REQUIRE(pthread_attr_setstacksize(&attributes, std::max(kStack, least)) == 0);
    pthread_t thread;
    REQUIRE(pthread_create(&thread, &attributes, body, const_cast<Pair*>(&pair)) == 0);
    REQUIRE(pthread_join(thread, nullptr) == 0);
    pthread_attr_destroy(&attributes);
}
