// A template that grows, through the C API, on a rendered sequence with exact truth: a camera that
// slides along tissue.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_film.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

constexpr int kFilmWidth = 480, kFilmHeight = 270, kFrames = 26;

// From that frame on, points are followed on tissue that the first did not show.
constexpr int kNewPoints = 16;

struct Filmed {
    std::vector<uint8_t> left, right;
    std::vector<cli::Film::Truth> truth;  // of the points there are
};

// The sequence, rendered once.
struct Recording {
    cli::Film film{"slide", kFilmWidth, kFilmHeight, kFrames, 1, 2, {}};
    std::vector<Filmed> frames;
    size_t first_points = 0;  // of the first frame
    Recording() {
        for (int i = 0; i < kFrames; ++i) {
            film.advance();
            if (i == kNewPoints) {
                first_points = film.points().size();
                film.add_points();
            }
            Filmed& frame = frames.emplace_back(Filmed{film.left_bgr(), film.right_bgr(), {}});
            for (size_t p = 0; p < film.points().size(); ++p) frame.truth.push_back(film.truth(p));
        }
    }
};
const Recording& recording() {
    static const Recording made;
    return made;
}

struct Session : TrackingSession {
    explicit Session(uint32_t frames_in_flight = 2, uint32_t max_vertices = 0, uint32_t grow = 1,
                     const char* device = "cpu")
        : TrackingSession(
              device, 2,
              [&](defrec_rig_desc& rig_desc, defrec_tracker_desc& desc) {
                  describe_rig(recording().film.scene().rig, kFilmWidth, kFilmHeight, rig_desc);
                  desc.format = DEFREC_FORMAT_BGR8;
                  desc.frames_in_flight = frames_in_flight;
                  desc.grow = grow;
                  desc.max_vertices = max_vertices;
              },
              [&](defrec_context_desc& desc) {
                  if (std::string(device) != "asynchronous") return;  // one context at a time
                  static const std::string asynchronous =
                      std::string(DEFREC_BUILD_DIR) + "/test_plugins/asynchronous";
                  static const char* const paths[] = {asynchronous.c_str()};
                  desc.plugin_paths = paths;
                  desc.plugin_path_count = 1;
              }) {}

    defrec_job submit(int frame) {
        TrackingSession::Frame images;
        images.left.pixels = recording().frames[static_cast<size_t>(frame)].left.data();
        images.right.pixels = recording().frames[static_cast<size_t>(frame)].right.data();
        defrec_job job = nullptr;
        REQUIRE_OK(TrackingSession::submit(images, &job));
        return job;
    }
    // The job is done and not released.
    defrec_job track(int frame, defrec_result& result) {
        const defrec_job job = submit(frame);
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        return job;
    }
};

// All results, a number of frames being under way at a time.
std::string results_of(uint32_t frames_in_flight, const char* device = "cpu") {
    Session session(frames_in_flight, 0, 1, device);
    std::string results;
    std::deque<defrec_job> jobs;
    for (int i = 0; i < kFrames || !jobs.empty();) {
        if (i < kFrames && jobs.size() < frames_in_flight) {
            jobs.push_back(session.submit(i++));
            continue;
        }
        results += take_result(jobs.front());
        jobs.pop_front();
    }
    return results;
}

// The share of a frame's pixels, on a grid, that lie on the surface.
double covered_share(defrec_job job) {
    std::vector<double> pixels;
    for (int v = 10; v < kFilmHeight; v += 20)
        for (int u = 10; u < kFilmWidth; u += 20)
            pixels.insert(pixels.end(), {double(u), double(v)});
    std::vector<double> xyz(pixels.size() / 2 * 3);
    std::vector<uint8_t> found(pixels.size() / 2);
    REQUIRE_OK(defrec_job_lift_points(job, pixels.data(), found.size(), xyz.data(), found.data()));
    return static_cast<double>(std::count(found.begin(), found.end(), 1)) /
           static_cast<double>(found.size());
}

}  // namespace

TEST_CASE("a template grows with what comes into view, and held results keep their counts") {
    Session session, fixed(2, 0, 0);
    defrec_result first, result, without;
    const defrec_job held = session.track(0, first);
    uint32_t grown = 0;
    defrec_template before = nullptr;
    REQUIRE_OK(defrec_job_get_template(held, &before));
    uint64_t vertices = first.vertex_count;
    for (int i = 1; i < kFrames; ++i) {
        CAPTURE(i);
        const defrec_job job = session.track(i, result), other = [&] {
            if (i == 1) defrec_job_release(fixed.track(0, without));
            return fixed.track(i, without);
        }();
        CHECK((result.state == DEFREC_TRACKING || result.state == DEFREC_DEGRADED));
        const bool grew = (result.reasons & DEFREC_REASON_TEMPLATE_GREW) != 0;
        grown += grew;
        CHECK((result.vertex_count > vertices) == grew);
        CHECK(result.template_epoch == 1 + grown);
        CHECK(result.epoch == 1);
        CHECK(without.template_epoch == 1);
        CHECK((without.reasons & DEFREC_REASON_TEMPLATE_GREW) == 0);
        vertices = result.vertex_count;
        if (i + 1 == kFrames) {
            CHECK(covered_share(job) > covered_share(other) + 0.1);
            CHECK(covered_share(job) > 0.8);
            defrec_template surface = nullptr;
            REQUIRE_OK(defrec_job_get_template(job, &surface));
            defrec_template_info info;
            DEFREC_INIT(&info);
            REQUIRE_OK(defrec_template_get(surface, &info));
            CHECK(info.vertex_count == result.vertex_count);
            CHECK(info.node_count == result.node_count);
            defrec_template_release(surface);
        }
        defrec_job_release(job);
        defrec_job_release(other);
    }
    CHECK(grown >= 2);
    defrec_template_info info;
    DEFREC_INIT(&info);
    REQUIRE_OK(defrec_template_get(before, &info));
    CHECK(info.vertex_count == first.vertex_count);
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(held, &result));
    CHECK(result.vertex_count == first.vertex_count);
    CHECK(result.vertices == first.vertices);
    defrec_template_release(before);
    defrec_job_release(held);
}

TEST_CASE(
    "growth gives the same bits, however many frames are under way, and on a device beside the "
    "processor, which follows most frames before they are looked at") {
    const std::string one = results_of(1);
    CHECK(one == results_of(3));
    CHECK(one == results_of(1, "asynchronous"));
    CHECK(one == results_of(3, "asynchronous"));
}

TEST_CASE("a template that is full says so, and grows no more") {
    defrec_result result;
    uint64_t first = 0;
    {
        Session session;
        defrec_job_release(session.track(0, result));
        first = result.vertex_count;
    }
    Session session(2, static_cast<uint32_t>(first) + 1);
    for (int i = 0; i < kFrames; ++i) {
        defrec_job_release(session.track(i, result));
        CHECK(result.vertex_count == first);
    }
    CHECK((result.reasons & DEFREC_REASON_TEMPLATE_FULL) != 0);
    CHECK(result.template_epoch == 1);
}

TEST_CASE("a template that is full stays so when it is cut") {
    // A part of a film, which moves to the right at first: to the camera a slide.
    constexpr int kWidth = 640, kHeight = 360, kPart = 480, kStep = 16, kEnd = 26;
    cli::Film film("cut", kWidth, kHeight, kEnd, 1, 2);
    uint64_t vertices = 0;
    bool was_full = false, was_cut = false;
    for (const bool only_first : {true, false}) {
        TrackingSession session(
            "cpu", 2, [&](defrec_rig_desc& rig_desc, defrec_tracker_desc& desc) {
                describe_rig(film.scene().rig, kPart, kHeight, rig_desc);
                desc.format = DEFREC_FORMAT_BGR8;
                desc.grow = 1;
                desc.max_vertices = static_cast<uint32_t>(vertices == 0 ? 0 : vertices + 1);
            });
        for (int i = 0; i < (only_first ? 1 : kEnd); ++i) {
            CAPTURE(i);
            if (only_first || i > 0) film.advance();
            const size_t skipped = 3 * static_cast<size_t>(std::min(kWidth - kPart, kStep * i));
            TrackingSession::Frame images;
            images.left = {film.left_bgr().data() + skipped, nullptr, uint64_t{3} * kWidth};
            images.right = {film.right_bgr().data() + skipped, nullptr, uint64_t{3} * kWidth};
            defrec_job job = nullptr;
            REQUIRE_OK(session.submit(images, &job));
            REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
            defrec_result result;
            DEFREC_INIT(&result);
            REQUIRE_OK(defrec_job_result(job, &result));
            vertices = result.vertex_count;
            const bool is_full = (result.reasons & DEFREC_REASON_TEMPLATE_FULL) != 0;
            if (was_full) CHECK(is_full);
            was_full = is_full;
            if ((result.reasons & DEFREC_REASON_CUT) != 0) was_cut = was_full;
            defrec_job_release(job);
        }
    }
    CHECK(was_cut);
}

TEST_CASE("a grown template goes through a file into another tracker, which goes on with it") {
    const TemporaryFolder folder;
    const std::string path = (folder.path() / "map").string();
    uint64_t vertices = 0, nodes = 0;
    {
        Session session;
        defrec_result result;
        for (int i = 0; i < kFrames; ++i) defrec_job_release(session.track(i, result));
        vertices = result.vertex_count;
        nodes = result.node_count;
        defrec_template surface = nullptr;
        REQUIRE_OK(defrec_tracker_get_template(session.tracker, &surface));
        REQUIRE_OK(defrec_template_save(surface, path.c_str()));
        defrec_template_release(surface);
    }
    Session session;
    defrec_template surface = nullptr;
    REQUIRE_OK(defrec_template_load(session.context, path.c_str(), &surface));
    REQUIRE_OK(defrec_tracker_set_template(session.tracker, surface));
    defrec_template_release(surface);
    // From the last view on, backwards: half of it was not in the first.
    defrec_result result;
    for (int i = kFrames - 1; i > kFrames - 6; --i) {
        CAPTURE(i);
        defrec_job_release(session.track(i, result));
        CHECK(result.state == (i == kFrames - 1 ? DEFREC_RELOCALISED : DEFREC_TRACKING));
        CHECK(result.vertex_count >= vertices);
        CHECK(result.node_count >= nodes);
    }
}

TEST_CASE("pixels of any frame are lifted to points that are followed from there") {
    Session session;
    const cli::Film& film = recording().film;
    const std::span points = std::span(film.points()).first(recording().first_points);
    defrec_result result;
    std::vector<double> xyz(3 * points.size()), back(xyz.size());
    std::vector<uint8_t> found(points.size());
    for (int i = 0; i < 12; ++i) {
        const defrec_job job = session.track(i, result);
        std::vector<double> pixels;
        if (i == 11) {
            // Where the surface has the points of the first frame now, they are found again.
            std::vector<double> first;
            for (const cli::Film::Followed& point : points)
                first.insert(first.end(), {point.u, point.v});
            defrec_template surface = nullptr;
            REQUIRE_OK(defrec_tracker_get_template(session.tracker, &surface));
            REQUIRE_OK(defrec_template_lift(surface, first.data(), points.size(), xyz.data(),
                                            found.data()));
            defrec_template_release(surface);
            std::vector<double> now(xyz.size());
            REQUIRE_OK(defrec_job_warp_points(job, xyz.data(), points.size(), now.data(), nullptr,
                                              nullptr));
            const cli::Lens& lens = film.scene().rig.left;
            for (size_t p = 0; p < points.size(); ++p) {
                pixels.push_back(lens.fx * now[3 * p] / now[3 * p + 2] + lens.cx);
                pixels.push_back(lens.fy * now[3 * p + 1] / now[3 * p + 2] + lens.cy);
            }
            std::vector<uint8_t> found_now(points.size());
            REQUIRE_OK(defrec_job_lift_points(job, pixels.data(), points.size(), back.data(),
                                              found_now.data()));
            size_t compared = 0;
            for (size_t p = 0; p < points.size(); ++p) {
                if (found[p] == 0 || found_now[p] == 0) continue;
                ++compared;
                double squared = 0;
                for (size_t axis = 0; axis < 3; ++axis)
                    squared += std::pow(back[3 * p + axis] - xyz[3 * p + axis], 2);
                CHECK(std::sqrt(squared) < 0.1);
            }
            CHECK(2 * compared > points.size());
        }
        defrec_job_release(job);
    }
    const double outside[4] = {-5, 20, std::nan(""), 20};
    const defrec_job job = session.track(12, result);
    REQUIRE_OK(defrec_job_lift_points(job, outside, 2, xyz.data(), found.data()));
    CHECK(found[0] + found[1] == 0);
    CHECK(xyz[0] == 0);
    CHECK(defrec_job_lift_points(job, nullptr, 1, xyz.data(), found.data()) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_job_lift_points(job, outside, 1, nullptr, found.data()) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_job_lift_points(job, outside, 1, xyz.data(), nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_job_get_template(job, nullptr) == DEFREC_ERROR_ARGUMENT);
    defrec_job_release(job);
}

TEST_CASE("points beside the surface are followed until it reaches them") {
    const size_t first = recording().first_points;
    const std::vector<cli::Film::Followed>& points = recording().film.points();
    const size_t count = points.size() - first;
    const cli::Lens& lens = recording().film.scene().rig.left;
    Session session, fixed(2, 0, 0);
    defrec_result result;
    std::vector<double> uv, xyz(3 * count), now(3 * count), error(count);
    for (size_t p = first; p < points.size(); ++p) uv.insert(uv.end(), {points[p].u, points[p].v});
    std::vector<uint8_t> found(count), status(count);
    size_t beside = 0, settled = 0, unknown = 0, extrapolated = 0;
    std::vector<double> errors;
    for (int i = 0; i < kFrames; ++i) {
        CAPTURE(i);
        const defrec_job job = session.track(i, result);
        if (i == kNewPoints) {
            REQUIRE_OK(defrec_job_lift_points(job, uv.data(), count, xyz.data(), found.data()));
            beside =
                static_cast<size_t>(std::count(found.begin(), found.end(), DEFREC_FOUND_BESIDE));
        }
        if (i >= kNewPoints) {
            REQUIRE_OK(defrec_job_warp_points(job, xyz.data(), count, now.data(), status.data(),
                                              error.data()));
            for (size_t p = 0; p < count; ++p) {
                if (found[p] == DEFREC_FOUND_NONE) continue;
                const cli::Film::Truth& truth =
                    recording().frames[static_cast<size_t>(i)].truth[first + p];
                unknown += status[p] == DEFREC_POINT_UNKNOWN;
                if (found[p] == DEFREC_FOUND_BESIDE) {
                    extrapolated += status[p] == DEFREC_POINT_EXTRAPOLATED;
                    errors.push_back(std::hypot(now[3 * p] - truth.position[0],
                                                now[3 * p + 1] - truth.position[1],
                                                now[3 * p + 2] - truth.position[2]));
                }
                const double pixel[2] = {lens.fx * now[3 * p] / now[3 * p + 2] + lens.cx,
                                         lens.fy * now[3 * p + 1] / now[3 * p + 2] + lens.cy};
                uint8_t again = 0;
                double place[3];
                REQUIRE_OK(defrec_job_lift_points(job, pixel, 1, place, &again));
                settled += found[p] == DEFREC_FOUND_BESIDE && i + 1 == kFrames &&
                           again == DEFREC_FOUND_SURFACE;
            }
        }
        defrec_job_release(job);
    }
    CHECK(beside >= 3);
    CHECK(settled == beside);
    CHECK(unknown == 0);
    CHECK(extrapolated > 0);
    std::sort(errors.begin(), errors.end());
    CHECK(errors[errors.size() / 2] < 0.3);
    CHECK(errors.back() < 1.5);
    // A template that does not grow is not extended.
    for (int i = 0; i <= kNewPoints; ++i) {
        const defrec_job job = fixed.track(i, result);
        if (i == kNewPoints) {
            REQUIRE_OK(defrec_job_lift_points(job, uv.data(), count, xyz.data(), found.data()));
            CHECK(std::count(found.begin(), found.end(), DEFREC_FOUND_BESIDE) == 0);
        }
        defrec_job_release(job);
    }
}

TEST_CASE("a lost template is found again over tissue that its first view did not show") {
    // The right part of a film in which the camera slides by more than the width of this part.
    constexpr uint32_t kPartWidth = 256, kSkipped = kFilmWidth - kPartWidth;
    constexpr int kThere = 35;
    cli::Film film("slide", kFilmWidth, kFilmHeight, kThere, 1, 2, {{"period", 60}});
    TrackingSession session("cpu", 2, [&](defrec_rig_desc& rig_desc, defrec_tracker_desc& desc) {
        describe_rig(film.scene().rig, kPartWidth, kFilmHeight, rig_desc);
        rig_desc.left.cx -= kSkipped;
        rig_desc.right.cx -= kSkipped;
        desc.format = DEFREC_FORMAT_BGR8;
        desc.grow = 1;
    });
    const std::vector<uint8_t> dark(size_t{3} * kFilmWidth * kFilmHeight, 0);
    const auto track = [&](const std::vector<uint8_t>& left, const std::vector<uint8_t>& right,
                           defrec_result& result) {
        TrackingSession::Frame images;
        images.left.pixels = left.data() + size_t{3} * kSkipped;
        images.right.pixels = right.data() + size_t{3} * kSkipped;
        images.left.stride = images.right.stride = uint64_t{3} * kFilmWidth;
        defrec_job job = nullptr;
        REQUIRE_OK(session.submit(images, &job));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        return job;
    };
    defrec_result result;
    uint64_t first_vertices = 0;
    for (int i = 0; i < kThere; ++i) {
        CAPTURE(i);
        film.advance();
        const defrec_job job = track(film.left_bgr(), film.right_bgr(), result);
        if (i == 0) first_vertices = result.vertex_count;
        CHECK((result.state == DEFREC_TRACKING || result.state == DEFREC_DEGRADED));
        defrec_job_release(job);
    }
    for (int i = 0; i < 3; ++i) {
        defrec_job_release(track(dark, dark, result));
        CHECK(result.state == DEFREC_LOST);
    }
    const defrec_job job = track(film.left_bgr(), film.right_bgr(), result);
    CHECK(result.state == DEFREC_RELOCALISED);
    CHECK(result.observed_share > 0.5f);
    const auto inside = [&](uint64_t vertex) {
        const float* p = result.vertices + 3 * vertex;
        const cli::Lens& lens = film.scene().rig.left;
        const double u = lens.fx * p[0] / p[2] + lens.cx - kSkipped;
        return u >= 0 && u < kPartWidth;
    };
    uint64_t of_first_view = 0;
    for (uint64_t i = 0; i < first_vertices; ++i) of_first_view += inside(i);
    CHECK(of_first_view == 0);
    defrec_job_release(job);
}
