// Points of a plan beneath the surface, and the body that carries them, through the C API: what is
// refused, with which words, and what becomes of the rest. How well a body moves:
// sdk/body/body_motion_test.cpp.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sdk/testing/plane_tracker.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_scene.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec::test;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                 kInfinity = std::numeric_limits<double>::infinity();

// A point of the plane at rest, or so deep beneath it along z.
void add_point(std::vector<double>& xyz, double x, double y, double deeper) {
    xyz.insert(xyz.end(), {x, y, kDepth + kSlope * x + deeper});
}
std::vector<double> points_at(double deeper) {
    std::vector<double> xyz;
    for (double y = -18; y <= 18; y += 6)
        for (double x = -24; x <= 24; x += 6) add_point(xyz, x, y, deeper);
    return xyz;
}

struct Moved {
    std::vector<double> xyz, covariance, expected_error;
    std::vector<uint8_t> status;
    explicit Moved(size_t count)
        : xyz(3 * count, -1),
          covariance(6 * count, -1),
          expected_error(count, -1),
          status(count, 99) {}
};
Moved warp(defrec_job job, const std::vector<double>& points) {
    const size_t count = points.size() / 3;
    Moved moved(count);
    REQUIRE_OK(defrec_job_warp_points(job, points.data(), count, moved.xyz.data(),
                                      moved.status.data(), moved.expected_error.data()));
    REQUIRE_OK(
        defrec_job_point_covariances(job, points.data(), count, moved.covariance.data(), nullptr));
    return moved;
}

// Destroyed with the object.
class Targets {
  public:
    Targets(defrec_template surface, const std::vector<double>& points)
        : count_(points.size() / 3) {
        REQUIRE_OK(defrec_targets_create(surface, points.data(), count_, &handle_));
    }
    ~Targets() { defrec_targets_destroy(handle_); }
    Targets(const Targets&) = delete;
    Targets& operator=(const Targets&) = delete;

    defrec_targets get() const { return handle_; }
    Moved move(defrec_job job) const {
        Moved moved(count_);
        REQUIRE_OK(defrec_job_move_targets(job, handle_, count_, moved.xyz.data(),
                                           moved.covariance.data(), moved.status.data(),
                                           moved.expected_error.data()));
        return moved;
    }

  private:
    size_t count_;
    defrec_targets handle_ = nullptr;
};

template <class Value>
bool same_bits(const std::vector<Value>& a, const std::vector<Value>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
}
bool same(const Moved& a, const Moved& b) {
    return same_bits(a.xyz, b.xyz) && same_bits(a.covariance, b.covariance) &&
           same_bits(a.status, b.status) && same_bits(a.expected_error, b.expected_error);
}

// How far points are from where the plane takes them, at most, mm.
double worst_of(const std::vector<double>& points, const std::vector<double>& moved, double dx,
                double dy) {
    double worst = 0;
    for (size_t i = 0; i < points.size(); i += 3)
        worst =
            std::max(worst, std::hypot(moved[i] - points[i] - dx, moved[i + 1] - points[i + 1] - dy,
                                       moved[i + 2] - points[i + 2] - kSlope * dx));
    return worst;
}

uint32_t body_state(defrec_job job) {
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(job, &result));
    return result.body;
}

// A box with its triangles.
struct Box {
    std::vector<float> xyz;
    std::vector<uint32_t> triangles{0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                    2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    Box(const double (&low)[3], const double (&high)[3]) {
        for (int corner = 0; corner < 8; ++corner)
            for (int axis = 0; axis < 3; ++axis)
                xyz.push_back(
                    static_cast<float>((corner >> axis & 1) != 0 ? high[axis] : low[axis]));
    }
    defrec_mesh mesh() const { return {xyz.data(), 8, triangles.data(), triangles.size() / 3}; }
    void turn_out() {
        for (size_t i = 0; i < triangles.size(); i += 3) std::swap(triangles[i], triangles[i + 1]);
    }
    void scale(float by) {
        for (float& value : xyz) value *= by;
    }
};
// Holds the whole plane.
Box whole_box() { return {{-60, -45, 66}, {60, 45, 130}}; }

defrec_body_desc body_desc() {
    defrec_body_desc desc;
    DEFREC_INIT(&desc);
    return desc;
}

void check_refused(defrec_template surface, const defrec_body_desc& desc,
                   const std::vector<std::string>& words) {
    const defrec_status status = defrec_template_set_body(surface, &desc);
    const std::string said = defrec_last_error();
    CAPTURE(said);
    CHECK(status == DEFREC_ERROR_ARGUMENT);
    for (const std::string& word : words) {
        CAPTURE(word);
        CHECK(contains(said, word));
    }
}

// A template whose body nobody wants: what is refused does not begin it.
class Refusals {
  public:
    Refusals() : tracker_(DEFREC_BODY_OFF) {}
    ~Refusals() {
        defrec_job job = tracker_.track(0, 0);
        CHECK(body_state(job) == DEFREC_BODY_STATE_NONE);
        defrec_job_release(job);
    }
    Refusals(const Refusals&) = delete;
    Refusals& operator=(const Refusals&) = delete;
    void check(const defrec_body_desc& desc, const std::vector<std::string>& words) {
        check_refused(tracker_.surface(), desc, words);
    }
    void check_mesh(const Box& box, const std::vector<std::string>& words) {
        defrec_body_desc desc = body_desc();
        desc.mesh = box.mesh();
        check(desc, words);
        // The mesh of a region likewise; it may lie anywhere.
        if (contains(words[0], "beside")) return;
        desc = body_desc();
        const defrec_body_region region{box.mesh(), 2, 0};
        desc.regions = &region;
        desc.region_count = 1;
        std::vector<std::string> of_region = words;
        of_region.emplace_back("regions[0].mesh");
        check(desc, of_region);
    }

  private:
    PlaneTracker tracker_;
};

void set_identity(double (&motion)[12]) {
    for (int i = 0; i < 12; ++i) motion[i] = i % 5 == 0 ? 1 : 0;
}

}  // namespace

TEST_CASE("row 130: targets that are not finite are unknown, and the others move") {
    PlaneTracker tracker;
    REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
    std::vector<double> points;
    for (int i = 0; i < 40; ++i) add_point(points, i - 20, 5, i % 3 * 8);
    const std::vector<double> good = points;
    std::vector<size_t> bad;
    for (const double value : {kNaN, kInfinity, -kInfinity})
        for (size_t axis = 0; axis < 3; ++axis) {
            bad.push_back(3 * bad.size() + 2 + axis % 2);
            points[3 * bad.back() + axis] = value;
        }
    defrec_job job = tracker.track(0.6, -0.4);
    const Targets targets(tracker.surface(), points);
    const Moved wanted = warp(job, good);
    for (const Moved& moved : {warp(job, points), targets.move(job)})
        for (size_t i = 0; i < 40; ++i) {
            const bool is_bad = std::find(bad.begin(), bad.end(), i) != bad.end();
            for (size_t axis = 0; axis < 3; ++axis)
                CHECK((is_bad ? std::isnan(moved.xyz[3 * i + axis])
                              : moved.xyz[3 * i + axis] == wanted.xyz[3 * i + axis]));
            CHECK(moved.status[i] == (is_bad ? uint8_t{DEFREC_POINT_UNKNOWN} : wanted.status[i]));
            CHECK(std::isnan(moved.covariance[6 * i]) == is_bad);
        }
    defrec_job_release(job);
    // So large that squares of it are not finite.
    job = tracker.track(0.6, -0.4);
    const std::vector<double> far{1e200, 0, 80, 0, -1e300, 80, 0, 0, 1e308, 1e9, 1e9, -1e9};
    for (const Moved& moved : {warp(job, far), Targets(tracker.surface(), far).move(job)})
        for (const uint8_t status : moved.status) CHECK(status == DEFREC_POINT_UNKNOWN);
    defrec_job_release(job);
}

TEST_CASE("row 131: more targets than a million are refused with the limit") {
    PlaneTracker tracker(DEFREC_BODY_OFF);
    const std::vector<double> points(3 * 1000000, 80.0);
    for (const size_t count : {size_t{1000001}, size_t{10000000}, SIZE_MAX}) {
        defrec_targets targets = nullptr;
        CHECK(defrec_targets_create(tracker.surface(), points.data(), count, &targets) ==
              DEFREC_ERROR_ARGUMENT);
        CHECK(contains(defrec_last_error(), "1000000 targets"));
        CHECK(contains(defrec_last_error(), std::to_string(count)));
        CHECK(targets == nullptr);
    }
    const Targets most(tracker.surface(), points);
    CHECK(defrec_targets_count(most.get()) == 1000000);
}

TEST_CASE("row 132: a body's mesh with a hole is refused with the edge and its place") {
    Refusals refusals;
    Box box = whole_box();
    box.triangles.resize(box.triangles.size() - 3);
    refusals.check_mesh(box, {"not closed", "edge", "(60 -45 130)"});
}

TEST_CASE("row 133: a mesh that is inside out is refused") {
    Refusals refusals;
    Box box = whole_box();
    box.turn_out();
    refusals.check_mesh(box, {"inside out", "clockwise"});
}

TEST_CASE("row 134: a mesh in metres is refused with the unit that it seems to be in") {
    Refusals refusals;
    Box box = whole_box();
    box.scale(0.001f);
    refusals.check_mesh(box, {"metres", "mm"});
    box.scale(1e6f);
    refusals.check_mesh(box, {"micrometres"});
}

TEST_CASE("row 135: a mesh beside the view is refused with the distance") {
    Refusals refusals;
    refusals.check_mesh({{200, -45, 66}, {320, 45, 130}}, {"beside the view", "mm from", "0 %"});
    Box box = whole_box();
    box.scale(0.1f);
    refusals.check_mesh(box, {"beside the view", "centimetres"});
}

TEST_CASE("row 136: a mesh of more than a million triangles is refused with the limit") {
    Refusals refusals;
    const Box box = whole_box();
    for (const bool are_triangles : {true, false}) {
        defrec_body_desc desc = body_desc();
        desc.mesh = box.mesh();
        (are_triangles ? desc.mesh.triangle_count : desc.mesh.vertex_count) = 2000000;
        refusals.check(desc, {"2000000", "1000000", are_triangles ? "triangle" : "vert"});
        desc.mesh.triangle_count = desc.mesh.vertex_count = UINT64_MAX;
        refusals.check(desc, {"1000000"});
    }
}

TEST_CASE("row 137: a target in front of the surface moves with the surface behind it") {
    PlaneTracker tracker;
    const std::vector<double> behind = points_at(0), in_front = points_at(-12);
    REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
    const Targets targets(tracker.surface(), in_front);
    for (int i = 1; i < 4; ++i) {
        defrec_job job = tracker.track(0.5 * i, -0.3 * i);
        const Moved surface = warp(job, behind);
        const Moved moved = targets.move(job);
        CHECK(worst_of(in_front, moved.xyz, 0.5 * i, -0.3 * i) < 0.7);
        for (size_t k = 0; k < in_front.size(); k += 3) {
            double squared = 0;
            for (size_t axis = 0; axis < 3; ++axis) {
                const double shift = moved.xyz[k + axis] - in_front[k + axis],
                             of_surface = surface.xyz[k + axis] - behind[k + axis];
                squared += (shift - of_surface) * (shift - of_surface);
            }
            // The surface may turn a little.
            CHECK(std::sqrt(squared) < 0.6);
            CHECK(moved.status[k / 3] != DEFREC_POINT_UNKNOWN);
        }
        defrec_job_release(job);
    }
}

TEST_CASE("row 139: a held motion or a camera's pose that is no rigid motion is refused") {
    PlaneTracker tracker(DEFREC_BODY_OFF);
    using Fault = std::function<void(double(&)[12])>;
    const Fault faults[] = {
        [](double(&m)[12]) { std::fill(std::begin(m), std::end(m), 0.0); },
        [](double(&m)[12]) { m[0] = 1.01; },
        [](double(&m)[12]) { m[10] = -1; },
        [](double(&m)[12]) { m[1] = 0.01; },
        [](double(&m)[12]) { m[5] = kNaN; },
        [](double(&m)[12]) { m[3] = kNaN; },
        [](double(&m)[12]) { m[7] = kInfinity; },
        [](double(&m)[12]) { m[11] = -1e9; },
    };
    for (const bool is_held : {true, false}) {
        const auto motion_of = [&](defrec_frame& frame) -> double(&)[12] {
            return is_held ? frame.held_motion : frame.camera_pose;
        };
        const uint32_t flag = is_held ? DEFREC_FRAME_HELD_MOTION : DEFREC_FRAME_CAMERA_POSE;
        for (const Fault& fault : faults) {
            const auto change = [&](defrec_frame& frame, uint32_t flags) {
                set_identity(motion_of(frame));
                fault(motion_of(frame));
                frame.flags = flags;
            };
            defrec_job job = nullptr;
            CHECK(tracker.submit(0, 0, &job, [&](defrec_frame& f) { change(f, flag); }) ==
                  DEFREC_ERROR_ARGUMENT);
            CHECK(job == nullptr);
            CHECK(contains(defrec_last_error(), is_held ? "held_motion" : "camera_pose"));
            // Not given, it is not read.
            job = tracker.track(0, 0, [&](defrec_frame& f) { change(f, 0); });
            defrec_job_release(job);
        }
        defrec_job job = tracker.track(0, 0, [&](defrec_frame& frame) {
            set_identity(motion_of(frame));
            frame.flags = flag;
        });
        defrec_job_release(job);
    }
}

TEST_CASE("a body that is refused leaves the one before") {
    PlaneTracker tracker;
    REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
    defrec_body_desc desc = body_desc();
    desc.poisson_ratio = 0.7f;
    check_refused(tracker.surface(), desc, {"poisson_ratio", "0.495"});
    CHECK(defrec_template_wait_body(tracker.surface(), 0) == DEFREC_OK);
    defrec_job job = tracker.track(0, 0);
    CHECK(body_state(job) == DEFREC_BODY_STATE_READY);
    defrec_job_release(job);
}

TEST_CASE("fields of a body that are out of range are refused by name") {
    Refusals refusals;
    for (const float ratio : {-0.1f, 0.005f, 0.496f, 0.5f, std::nanf("")}) {
        CAPTURE(ratio);
        defrec_body_desc desc = body_desc();
        desc.poisson_ratio = ratio;
        refusals.check(desc, {"poisson_ratio"});
    }
    for (const float depth : {-1.0f, 0.01f, 1001.0f, std::nanf("")}) {
        CAPTURE(depth);
        defrec_body_desc desc = body_desc();
        desc.cut_depth_mm = depth;
        refusals.check(desc, {"cut_depth_mm"});
    }
    defrec_body_desc desc = body_desc();
    desc.flags = 1;
    refusals.check(desc, {"flags"});
    desc = body_desc();
    desc.region_count = 1;
    refusals.check(desc, {"regions is NULL"});
    desc.region_count = 65;
    refusals.check(desc, {"region_count"});
    const Box box = whole_box();
    for (const float stiffness : {-1.0f, 0.001f, 1001.0f, std::nanf("")}) {
        CAPTURE(stiffness);
        const defrec_body_region regions[] = {{box.mesh(), 1, 0}, {box.mesh(), stiffness, 0}};
        desc = body_desc();
        desc.regions = regions;
        desc.region_count = 2;
        refusals.check(desc, {"regions[1].stiffness"});
    }
    const defrec_body_region region{box.mesh(), 1, 2};
    desc.regions = &region;
    desc.region_count = 1;
    refusals.check(desc, {"regions[0].flags"});
    desc = body_desc();
    desc.mesh.vertex_count = 8;
    refusals.check(desc, {"NULL"});
    desc.mesh = box.mesh();
    desc.mesh.triangles = nullptr;
    refusals.check(desc, {"NULL"});
}

TEST_CASE("row 16: targets of dead handles, other templates, and other counts are refused") {
    PlaneTracker tracker(DEFREC_BODY_OFF), other(DEFREC_BODY_OFF);
    const std::vector<double> points = points_at(5);
    const size_t count = points.size() / 3;
    Moved moved(count);
    double* const out = moved.xyz.data();
    defrec_targets targets = nullptr;
    const auto move = [&](defrec_job job, size_t number) {
        return defrec_job_move_targets(job, targets, number, out, nullptr, nullptr, nullptr);
    };
    CHECK(defrec_targets_create(nullptr, points.data(), count, &targets) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_targets_create(tracker.surface(), nullptr, count, &targets) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_targets_create(tracker.surface(), points.data(), count, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(targets == nullptr);
    defrec_job job = tracker.track(0, 0), other_job = other.track(0, 0);
    CHECK(move(job, count) == DEFREC_ERROR_ARGUMENT);

    REQUIRE_OK(defrec_targets_create(tracker.surface(), points.data(), count, &targets));
    CHECK(defrec_targets_count(targets) == count);
    CHECK(move(job, count) == DEFREC_OK);
    for (const size_t number : {size_t{0}, count - 1, count + 1, SIZE_MAX}) {
        CHECK(move(job, number) == DEFREC_ERROR_ARGUMENT);
        CHECK(contains(defrec_last_error(), std::to_string(count) + " targets"));
    }
    CHECK(defrec_job_move_targets(job, targets, count, nullptr, nullptr, nullptr, nullptr) ==
          DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "xyz"));
    CHECK(move(other_job, count) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "another template"));
    CHECK(move(nullptr, count) == DEFREC_ERROR_ARGUMENT);

    defrec_targets_destroy(targets);
    CHECK(move(job, count) == DEFREC_ERROR_HANDLE);
    CHECK(defrec_targets_count(targets) == 0);
    CHECK(defrec_targets_count(nullptr) == 0);
    CHECK(defrec_targets_count(reinterpret_cast<defrec_targets>(job)) == 0);
    defrec_targets_destroy(targets);
    defrec_targets_destroy(nullptr);
    targets = reinterpret_cast<defrec_targets>(tracker.surface());
    CHECK(move(job, count) == DEFREC_ERROR_HANDLE);

    // None are no fault.
    REQUIRE_OK(defrec_targets_create(tracker.surface(), nullptr, 0, &targets));
    CHECK(defrec_targets_count(targets) == 0);
    CHECK(defrec_job_move_targets(job, targets, 0, nullptr, nullptr, nullptr, nullptr) ==
          DEFREC_OK);
    defrec_targets_destroy(targets);
    defrec_job_release(job);
    defrec_job_release(other_job);

    const defrec_body_desc desc = body_desc();
    CHECK(defrec_template_set_body(nullptr, &desc) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_template_wait_body(nullptr, 0) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_template_wait_body(reinterpret_cast<defrec_template>(job), 0) ==
          DEFREC_ERROR_HANDLE);
}

TEST_CASE("targets outlive the template's handle, and their points those of the application") {
    PlaneTracker tracker(DEFREC_BODY_OFF);
    std::vector<double> points = points_at(0);
    const std::vector<double> copy = points;
    defrec_template surface = nullptr;
    defrec_job first = tracker.track(0, 0);
    REQUIRE_OK(defrec_job_get_template(first, &surface));
    defrec_job_release(first);
    const Targets targets(surface, points);
    defrec_template_release(surface);
    std::fill(points.begin(), points.end(), kNaN);
    defrec_job job = tracker.track(0.5, 0.2);
    CHECK(worst_of(copy, targets.move(job).xyz, 0.5, 0.2) < 0.4);
    defrec_job_release(job);
}

TEST_CASE("prepared targets move as warp_points and point_covariances have it, to the bit") {
    for (const uint32_t body : {DEFREC_BODY_ON, DEFREC_BODY_OFF}) {
        CAPTURE(body);
        PlaneTracker tracker(body);
        std::vector<double> points;
        for (int i = 0; i < 9000; ++i)
            add_point(points, std::fmod(0.618 * i, 1.0) * 80 - 40,
                      std::fmod(0.414 * i, 1.0) * 60 - 30, std::fmod(0.732 * i, 1.0) * 45 - 8);
        const std::vector<double> few(points.begin(), points.begin() + 3 * 20);
        const Targets all(tracker.surface(), points), some(tracker.surface(), few);
        if (body == DEFREC_BODY_ON)
            REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
        for (int i = 1; i < 3; ++i) {
            defrec_job job = tracker.track(0.4 * i, 0.1 * i);
            const Moved wanted = warp(job, points);
            CHECK(same(all.move(job), wanted));
            CHECK(same(some.move(job), warp(job, few)));
            CHECK(std::memcmp(some.move(job).xyz.data(), wanted.xyz.data(), 60 * sizeof(double)) ==
                  0);
            std::vector<double> in_place = points;
            REQUIRE_OK(defrec_job_warp_points(job, in_place.data(), points.size() / 3,
                                              in_place.data(), nullptr, nullptr));
            CHECK(same_bits(in_place, wanted.xyz));
            for (size_t k = 0; k < wanted.status.size(); ++k) {
                const double* c = &wanted.covariance[6 * k];
                CHECK(std::abs(std::sqrt(c[0] + c[3] + c[5]) - wanted.expected_error[k]) <
                      1e-3 * wanted.expected_error[k]);
            }
            defrec_job_release(job);
        }
    }
}

TEST_CASE("points that are moved again and again move as each does alone, to the bit") {
    for (const uint32_t body : {DEFREC_BODY_ON, DEFREC_BODY_OFF}) {
        CAPTURE(body);
        PlaneTracker tracker(body);
        std::vector<double> points;
        for (int i = 0; i < 900; ++i)
            add_point(points, std::fmod(0.618 * i, 1.0) * 80 - 40,
                      std::fmod(0.414 * i, 1.0) * 60 - 30, std::fmod(0.732 * i, 1.0) * 45 - 8);
        points[3 * 450] = kNaN;
        std::vector<double> others = points;
        others[3 * 300 + 2] += 0.25;  // as many, and but for one the same
        if (body == DEFREC_BODY_ON)
            REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
        for (int i = 1; i < 4; ++i) {
            defrec_job job = tracker.track(0.4 * i, 0.1 * i);
            for (const auto* set : {&points, &others, &points}) {
                const Moved moved = warp(job, *set);
                CHECK(same(moved, warp(job, *set)));
                for (size_t k = 0; k < 900; k += 30) {
                    const auto from = set->begin() + static_cast<std::ptrdiff_t>(3 * k);
                    const Moved alone = warp(job, {from, from + 90});
                    CHECK(std::memcmp(alone.xyz.data(), &moved.xyz[3 * k], 90 * sizeof(double)) ==
                          0);
                    CHECK(std::memcmp(alone.covariance.data(), &moved.covariance[6 * k],
                                      180 * sizeof(double)) == 0);
                    CHECK(std::memcmp(alone.status.data(), &moved.status[k], 30) == 0);
                }
            }
            defrec_job_release(job);
        }
    }
}

TEST_CASE("points on the surface move as without a body, deep ones are never observed") {
    PlaneTracker with, without(DEFREC_BODY_OFF);
    REQUIRE_OK(defrec_template_wait_body(with.surface(), UINT64_MAX));
    std::vector<double> uv;
    for (double v = 40; v < kHeight - 40; v += 16)
        for (double u = 40; u < kWidth - 40; u += 16) uv.insert(uv.end(), {u, v});
    std::vector<double> lifted(uv.size() / 2 * 3);
    std::vector<uint8_t> found(uv.size() / 2);
    REQUIRE_OK(
        defrec_template_lift(with.surface(), uv.data(), found.size(), lifted.data(), found.data()));
    for (int i = 1; i < 4; ++i) {
        defrec_job one = with.track(0.5 * i, 0.2 * i), other = without.track(0.5 * i, 0.2 * i);
        CHECK(body_state(one) == DEFREC_BODY_STATE_READY);
        CHECK(body_state(other) == DEFREC_BODY_STATE_NONE);
        const Moved on_surface = warp(one, lifted);
        CHECK(same(on_surface, warp(other, lifted)));
        CHECK(std::count(on_surface.status.begin(), on_surface.status.end(),
                         DEFREC_POINT_OBSERVED) > static_cast<std::ptrdiff_t>(found.size() / 2));
        for (defrec_job job : {one, other})
            for (const double deeper : {6.0, 15.0, 30.0}) {
                CAPTURE(deeper);
                const Moved deep = warp(job, points_at(deeper));
                CHECK(worst_of(points_at(deeper), deep.xyz, 0.5 * i, 0.2 * i) < 0.6);
                for (size_t k = 0; k < deep.status.size(); ++k) {
                    CHECK(deep.status[k] == DEFREC_POINT_EXTRAPOLATED);
                    // Until rows tell, a lag that is plausible is part of it.
                    CHECK(deep.expected_error[k] < 6);
                }
            }
        defrec_job_release(one);
        defrec_job_release(other);
    }
}

TEST_CASE("in a frame that is lost targets stay where they were, unknown, with large errors") {
    for (const uint32_t body : {DEFREC_BODY_ON, DEFREC_BODY_OFF}) {
        CAPTURE(body);
        PlaneTracker tracker(body);
        if (body == DEFREC_BODY_ON)
            REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
        const std::vector<double> points = points_at(15);
        for (int i = 1; i < 7; ++i) defrec_job_release(tracker.track(0.5 * i, -0.3 * i));
        defrec_job job = tracker.lose();
        const Moved moved = warp(job, points);
        CHECK(worst_of(points, moved.xyz, 3, -1.8) < 0.6);
        for (size_t k = 0; k < moved.status.size(); ++k) {
            CHECK(moved.status[k] == DEFREC_POINT_UNKNOWN);
            CHECK(moved.expected_error[k] > 2);
        }
        defrec_job_release(job);
    }
}

TEST_CASE("expected errors grow with the depth and beyond the body, where points are unknown") {
    PlaneTracker tracker;
    REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
    defrec_job job = tracker.track(0.5, 0.2);
    const Moved moved = warp(job, {0, 0, kDepth + 10, 0, 0, kDepth + 60, 0, 0, kDepth + 150});
    CHECK(moved.status[0] == DEFREC_POINT_EXTRAPOLATED);
    CHECK(moved.status[2] == DEFREC_POINT_UNKNOWN);
    CHECK(moved.expected_error[1] >= moved.expected_error[0]);
    CHECK(moved.expected_error[2] > moved.expected_error[1]);
    defrec_job_release(job);
}

TEST_CASE(
    "without a body points move all the same; a body that is set is made when it is waited for") {
    PlaneTracker tracker(DEFREC_BODY_OFF);
    const std::vector<double> points = points_at(12);
    defrec_job job = tracker.track(0.5, 0.2);
    CHECK(body_state(job) == DEFREC_BODY_STATE_NONE);
    CHECK(worst_of(points, warp(job, points).xyz, 0.5, 0.2) < 0.6);
    const Targets targets(tracker.surface(), points);
    CHECK(worst_of(points, targets.move(job).xyz, 0.5, 0.2) < 0.6);

    const Box box = whole_box();
    // Held on the far side, and that moves.
    const Box base({-60, -45, 110}, {60, 45, 130});
    const defrec_body_region region{base.mesh(), 0, DEFREC_REGION_HELD};
    defrec_body_desc desc = body_desc();
    desc.mesh = box.mesh();
    desc.regions = &region;
    desc.region_count = 1;
    REQUIRE_OK(defrec_template_set_body(tracker.surface(), &desc));
    REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
    CHECK(defrec_template_wait_body(tracker.surface(), 0) == DEFREC_OK);
    CHECK(body_state(job) == DEFREC_BODY_STATE_READY);
    CHECK(worst_of(points, targets.move(job).xyz, 0.5, 0.2) < 0.6);
    defrec_job_release(job);

    constexpr double kHeldMm = 4;
    job = tracker.track(0.5, 0.2, [&](defrec_frame& frame) {
        frame.flags = DEFREC_FRAME_HELD_MOTION;
        set_identity(frame.held_motion);
        frame.held_motion[11] = kHeldMm;
    });
    const Moved moved = warp(job, {0, 0, kDepth, 0, 0, kDepth + 15, 0, 0, kDepth + 42});
    CHECK(std::abs(moved.xyz[2] - kDepth) < 0.5);
    const double middle = moved.xyz[5] - kDepth - 15, deep = moved.xyz[8] - kDepth - 42;
    CHECK(middle > 0.5);
    CHECK(middle < kHeldMm - 0.5);
    CHECK(std::abs(deep - kHeldMm) < 0.4);
    defrec_job_release(job);

    // The tissue beneath the surface, as before anything was said.
    REQUIRE_OK(defrec_template_set_body(tracker.surface(), nullptr));
    REQUIRE_OK(defrec_template_wait_body(tracker.surface(), UINT64_MAX));
    job = tracker.track(0.5, 0.2);
    CHECK(worst_of(points, targets.move(job).xyz, 0.5, 0.2) < 0.6);
    defrec_job_release(job);
}

TEST_CASE("several threads ask for points of one frame while its body is made and changed") {
    PlaneTracker tracker;
    std::vector<double> points;
    for (int i = 0; i < 60; ++i) add_point(points, i - 30, 0, i % 4 * 7);
    const Targets targets(tracker.surface(), points);
    defrec_job job = tracker.track(0.5, 0.2);
    std::atomic<int> faults{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t)
        threads.emplace_back([&, t] {
            std::vector<double> xyz(points.size());
            for (int i = 0; i < 40; ++i) {
                const defrec_status status =
                    t == 0 ? defrec_job_warp_points(job, points.data(), 60, xyz.data(), nullptr,
                                                    nullptr)
                           : defrec_job_move_targets(job, targets.get(), 60, xyz.data(), nullptr,
                                                     nullptr, nullptr);
                for (const double value : xyz) faults += !std::isfinite(value);
                faults += status != DEFREC_OK;
                if (t == 2 && i % 20 == 0)
                    faults += defrec_template_set_body(tracker.surface(), nullptr) != DEFREC_OK;
            }
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(faults == 0);
    defrec_job_release(job);
}
