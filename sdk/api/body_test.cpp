// Points beneath the surface through the C API: targets, the body from an application, bad input.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "sdk/api/test_frames.hpp"
#include "sdk/api/test_scene.hpp"
#include "sdk/api/test_session.hpp"

namespace {

using namespace defrec::test;

// A tracker with a template and one tracked frame.
struct Tracked {
    TrackingSession session{"cpu", 2};
    defrec_job job = nullptr;
    defrec_template surface = nullptr;

    Tracked() {
        for (int i = 0; i < 2; ++i) {
            const Pair pair = render(0.4 * i, -0.2 * i);
            if (job != nullptr) defrec_job_release(job);
            REQUIRE_OK(session.submit({{pair.left.data()}, {pair.right.data()}, {}}, &job));
            REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        }
        REQUIRE_OK(defrec_job_get_template(job, &surface));
        REQUIRE_OK(defrec_template_wait_body(surface, UINT64_MAX));
    }
    ~Tracked() {
        defrec_job_release(job);
        defrec_template_release(surface);
    }
    uint32_t body_state() const {
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        return result.body;
    }
};

// A box about the scene's middle, from z to z + depth; two triangles a side, outward.
struct Box {
    std::vector<float> vertices;
    std::vector<uint32_t> triangles{0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                    1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
    Box(float half, float z, float depth) {
        for (const float at : {z, z + depth})
            for (const auto& [x, y] :
                 {std::pair{-half, -half}, {half, -half}, {half, half}, {-half, half}})
                vertices.insert(vertices.end(), {x, y, at});
    }
    defrec_mesh mesh() const {
        return {vertices.data(), vertices.size() / 3, triangles.data(), triangles.size() / 3};
    }
};

void expect_refused(defrec_template surface, const defrec_body_desc& desc, const char* word) {
    CHECK(defrec_template_set_body(surface, &desc) == DEFREC_ERROR_ARGUMENT);
    CAPTURE(defrec_last_error());
    CHECK(std::string(defrec_last_error()).find(word) != std::string::npos);
}

}  // namespace

TEST_CASE("targets move as points do, and beneath the surface are never observed") {
    const Tracked tracked;
    CHECK(tracked.body_state() == DEFREC_BODY_STATE_READY);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<double> at_rest{0,   0, kDepth + 10, 3, -2, kDepth + 20, 0, 0, kDepth,
                                      nan, 0, kDepth,      0, 0,  kDepth - 15};
    const size_t count = at_rest.size() / 3;
    std::vector<double> xyz(3 * count), moved(3 * count), covariance(6 * count), errors(count),
        target_errors(count);
    std::vector<uint8_t> status(count), target_status(count);
    REQUIRE_OK(defrec_job_warp_points(tracked.job, at_rest.data(), count, xyz.data(), status.data(),
                                      errors.data()));
    defrec_targets targets = nullptr;
    REQUIRE_OK(defrec_targets_create(tracked.surface, at_rest.data(), count, &targets));
    CHECK(defrec_targets_count(targets) == count);
    REQUIRE_OK(defrec_job_move_targets(tracked.job, targets, count, moved.data(), covariance.data(),
                                       target_status.data(), target_errors.data()));
    CHECK(std::memcmp(moved.data(), xyz.data(), 8 * xyz.size()) == 0);
    CHECK(target_status == status);
    CHECK(status[0] == DEFREC_POINT_EXTRAPOLATED);
    CHECK(status[1] == DEFREC_POINT_EXTRAPOLATED);
    CHECK(status[3] == DEFREC_POINT_UNKNOWN);
    CHECK(std::isnan(moved[9]));
    // The scene moves as a rigid body, a target in front of the surface with it.
    for (const size_t i : {size_t{0}, size_t{1}, size_t{4}})
        for (size_t axis = 0; axis < 3; ++axis)
            CHECK(std::abs((moved[3 * i + axis] - at_rest[3 * i + axis]) -
                           (moved[6 + axis] - at_rest[6 + axis])) < 0.6);
    CHECK(target_errors[1] ==
          doctest::Approx(std::sqrt(covariance[6] + covariance[9] + covariance[11])));
    CHECK(defrec_job_move_targets(tracked.job, targets, count - 1, moved.data(), nullptr, nullptr,
                                  nullptr) == DEFREC_ERROR_ARGUMENT);
    defrec_targets none = nullptr;
    CHECK(defrec_targets_create(tracked.surface, at_rest.data(), 1000001, &none) ==
          DEFREC_ERROR_ARGUMENT);
    defrec_targets_destroy(targets);
    CHECK(defrec_targets_count(targets) == 0);
    defrec_targets_destroy(nullptr);
}

TEST_CASE("a body from the application is checked, computed and used") {
    const Tracked tracked;
    defrec_body_desc desc;
    DEFREC_INIT(&desc);
    const float z = static_cast<float>(kDepth) - 8;
    const Box box(70, z, 70), small(5, static_cast<float>(kDepth) + 15, 10);
    desc.mesh = box.mesh();
    const defrec_body_region region{small.mesh(), 10, 0};
    desc.regions = &region;
    desc.region_count = 1;
    REQUIRE_OK(defrec_template_set_body(tracked.surface, &desc));
    REQUIRE_OK(defrec_template_wait_body(tracked.surface, UINT64_MAX));
    const double deep[3] = {0, 0, kDepth + 20};
    double moved[3];
    uint8_t status = 0;
    REQUIRE_OK(defrec_job_warp_points(tracked.job, deep, 1, moved, &status, nullptr));
    CHECK(status == DEFREC_POINT_EXTRAPOLATED);

    Box open = box;
    open.triangles.resize(open.triangles.size() - 3);
    desc.mesh = open.mesh();
    expect_refused(tracked.surface, desc, "closed");
    Box inside_out = box;
    for (size_t i = 0; i < inside_out.triangles.size(); i += 3)
        std::swap(inside_out.triangles[i], inside_out.triangles[i + 1]);
    desc.mesh = inside_out.mesh();
    expect_refused(tracked.surface, desc, "inside out");
    Box metres = box;
    for (float& value : metres.vertices) value /= 1000;
    desc.mesh = metres.mesh();
    expect_refused(tracked.surface, desc, "metres");
    Box beside = box;
    for (size_t i = 0; i < beside.vertices.size(); i += 3) beside.vertices[i] += 500;
    desc.mesh = beside.mesh();
    expect_refused(tracked.surface, desc, "beside");
    desc.mesh = box.mesh();
    desc.mesh.triangle_count = 2000000;
    expect_refused(tracked.surface, desc, "triangle");
    desc.mesh = box.mesh();
    desc.poisson_ratio = 0.6f;
    expect_refused(tracked.surface, desc, "poisson_ratio");
    REQUIRE_OK(defrec_template_set_body(tracked.surface, nullptr));
    CHECK(defrec_template_wait_body(tracked.surface, 0) >= DEFREC_OK);
}
