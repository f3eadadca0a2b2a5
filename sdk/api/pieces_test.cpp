// A surface of two pieces, of which one is hidden for a while, through the C API, on a rendered
// sequence with exact truth.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sdk/testing/test_film.hpp"
#include "sdk/testing/test_scene.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

constexpr int kFilmWidth = 640, kFilmHeight = 360, kFrames = 30;
// The instrument comes from frame 2 on and is gone in frame 26.
constexpr int kHidden = 9, kHiddenUntil = 20, kSeenAgain = 27;

struct Pieces {
    explicit Pieces(defrec_template surface) {
        DEFREC_INIT(&info);
        REQUIRE_OK(defrec_template_get(surface, &info));
    }
    // The piece with most of the vertices behind.
    size_t farther() const {
        double depth[2] = {};
        size_t count[2] = {};
        for (uint64_t i = 0; i < info.vertex_count; ++i) {
            depth[info.vertex_pieces[i]] += double{info.vertices[i].position[2]};
            ++count[info.vertex_pieces[i]];
        }
        REQUIRE(count[0] > 500);
        REQUIRE(count[1] > 500);
        return depth[1] / static_cast<double>(count[1]) > depth[0] / static_cast<double>(count[0]);
    }
    void check_nothing_joins() const {
        const uint8_t* piece = info.vertex_pieces;
        for (uint64_t i = 0; i < 3 * info.triangle_count; i += 3) {
            const uint32_t* corner = info.triangles + i;
            CHECK(piece[corner[0]] == piece[corner[1]]);
            CHECK(piece[corner[0]] == piece[corner[2]]);
        }
    }
    defrec_template_info info;
};

std::vector<uint8_t> pieces_of(defrec_template surface, const std::vector<double>& xyz) {
    std::vector<uint8_t> pieces(xyz.size() / 3, 99);
    REQUIRE_OK(defrec_template_point_pieces(surface, xyz.data(), pieces.size(), pieces.data()));
    return pieces;
}

}  // namespace

TEST_CASE("a piece that is hidden is lost alone, says so, and is found again where it went") {
    cli::Film film("lobes", kFilmWidth, kFilmHeight, kFrames, 1, 2, {{"covered", 12}});
    TrackingSession session = session_of(film, kFilmWidth, kFilmHeight);
    LiftedPoints points;
    std::vector<uint8_t> piece_of_point;
    size_t hidden = 0;
    bool was_lost = false, was_found_again = false;
    for (int i = 0; i < kFrames; ++i) {
        CAPTURE(i);
        defrec_job job = track_next(session, film);
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        CHECK(result.state != DEFREC_LOST);
        REQUIRE(result.piece_count == 2);
        defrec_template surface = nullptr;
        REQUIRE_OK(defrec_job_get_template(job, &surface));
        const Pieces pieces(surface);
        CHECK(pieces.info.piece_count == 2);
        if (i == 0) {
            pieces.check_nothing_joins();
            hidden = pieces.farther();
            points = lift_film(surface, film);
            piece_of_point = pieces_of(surface, points.xyz);
        }
        const defrec_piece &seen = result.pieces[1 - hidden], &lost = result.pieces[hidden];
        CHECK((seen.state == DEFREC_TRACKING || seen.state == DEFREC_DEGRADED));
        CHECK(seen.age == 0);
        CHECK(seen.observed_share > 0.3);
        const bool is_lost = lost.state == DEFREC_LOST;
        CHECK(((result.reasons & DEFREC_REASON_PIECE_LOST) != 0) == is_lost);
        if (is_lost) CHECK(result.state == DEFREC_DEGRADED);
        if (i >= kHidden && i <= kHiddenUntil) CHECK(is_lost);
        if (i >= kSeenAgain) CHECK(!is_lost);
        was_found_again |= was_lost && lost.state == DEFREC_RELOCALISED;
        was_lost = is_lost;

        std::vector<double> xyz(points.xyz.size()), expected(points.of_film.size());
        std::vector<uint8_t> status(points.of_film.size());
        REQUIRE_OK(defrec_job_warp_points(job, points.xyz.data(), status.size(), xyz.data(),
                                          status.data(), expected.data()));
        for (size_t p = 0; p < status.size(); ++p) {
            const bool is_of_lost = is_lost && piece_of_point[p] == hidden;
            if (is_of_lost) CHECK(status[p] == DEFREC_POINT_UNKNOWN);
            if (status[p] != DEFREC_POINT_OBSERVED) continue;
            const Eigen::Map<const Eigen::Vector3d> now(&xyz[3 * p]);
            // A check that is only compared where it is predicted says less of where it is.
            CHECK((now - film.truth(points.of_film[p]).position).norm() <=
                  std::max(1.0, 2 * expected[p]));
        }
        // Nothing is lifted from where a piece was.
        std::vector<double> uv, lifted(points.xyz.size());
        const defrec_camera& camera = pieces.info.camera;
        for (size_t p = 0; p < status.size(); ++p) {
            const double* at = &xyz[3 * p];
            uv.insert(uv.end(), {camera.fx * at[0] / at[2] + camera.cx,
                                 camera.fy * at[1] / at[2] + camera.cy});
        }
        std::vector<uint8_t> found(status.size());
        REQUIRE_OK(
            defrec_job_lift_points(job, uv.data(), found.size(), lifted.data(), found.data()));
        const std::vector<uint8_t> of_lifted = pieces_of(surface, lifted);
        size_t again = 0, elsewhere = 0;
        for (size_t p = 0; p < found.size(); ++p) {
            if (found[p] == 0) continue;
            if (is_lost) CHECK(of_lifted[p] != hidden);
            ++(of_lifted[p] == piece_of_point[p] ? again : elsewhere);
        }
        CHECK(again > found.size() / 4);
        CHECK(elsewhere <= found.size() / 50);
        defrec_template_release(surface);
        defrec_job_release(job);
    }
    CHECK(was_found_again);
}

TEST_CASE("a point that is not finite belongs to no piece") {
    TrackingSession session("cpu");
    defrec_job job = nullptr;
    const Pair images = render(0, 0);
    TrackingSession::Frame frame;
    frame.left.pixels = images.left.data();
    frame.right.pixels = images.right.data();
    REQUIRE_OK(session.submit(frame, &job));
    REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
    defrec_template surface = nullptr;
    REQUIRE_OK(defrec_job_get_template(job, &surface));
    const double none = std::numeric_limits<double>::quiet_NaN();
    CHECK(pieces_of(surface, {0, 0, 80, none, 0, 80, 0, 0, 1e300}) ==
          std::vector<uint8_t>{0, 255, 0});
    CHECK(defrec_template_point_pieces(surface, nullptr, 1, nullptr) == DEFREC_ERROR_ARGUMENT);
    defrec_template_release(surface);
    defrec_job_release(job);
}
