// Tissue that comes apart, through the C API, on a rendered sequence with exact truth.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sdk/testing/cut_film.hpp"
#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_film.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

constexpr int kFilmWidth = 640, kFilmHeight = 360, kFrames = 30;

bool is_released(const uint32_t* triangle) {
    return triangle[0] == triangle[1] && triangle[1] == triangle[2];
}

}  // namespace

TEST_CASE("a cut is noticed, and both of its sides are followed") {
    cli::Film film("cut", kFilmWidth, kFilmHeight, kFrames, 1, 2);
    TrackingSession session = session_of(film, kFilmWidth, kFilmHeight);
    LiftedPoints lifted;
    uint32_t cuts = 0;
    uint64_t vertices = 0, triangles = 0;
    std::vector<double> errors;  // of all points, once it was noticed
    for (int i = 0; i < kFrames; ++i) {
        CAPTURE(i);
        defrec_job job = track_next(session, film);
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        CHECK(result.state == DEFREC_TRACKING);
        const bool is_cut = (result.reasons & DEFREC_REASON_CUT) != 0;
        cuts += is_cut;
        CHECK(result.template_epoch == 1 + cuts);
        defrec_template surface = nullptr;
        REQUIRE_OK(defrec_job_get_template(job, &surface));
        defrec_template_info info;
        DEFREC_INIT(&info);
        REQUIRE_OK(defrec_template_get(surface, &info));
        if (i == 0) {
            vertices = info.vertex_count;
            triangles = info.triangle_count;
            lifted = lift_film(surface, film);
        }
        CHECK(info.vertex_count == vertices);
        CHECK(info.triangle_count == triangles);
        CHECK((info.cut_point_count > 0) == (cuts > 0));
        size_t released = 0;
        for (uint64_t k = 0; k < info.triangle_count; ++k)
            released += is_released(info.triangles + 3 * k);
        CHECK((released > 10) == (cuts > 0));
        for (uint64_t k = 0; k < info.cut_point_count; ++k) {
            CHECK(info.cut_points[k].cut < cuts);
            CHECK(std::abs(info.cut_points[k].position[2] - 80) < 25);
        }

        std::vector<double> xyz(lifted.xyz.size()), expected(lifted.of_film.size());
        std::vector<uint8_t> status(lifted.of_film.size());
        REQUIRE_OK(defrec_job_warp_points(job, lifted.xyz.data(), lifted.of_film.size(), xyz.data(),
                                          status.data(), expected.data()));
        for (size_t p = 0; p < lifted.of_film.size(); ++p) {
            const Eigen::Map<const Eigen::Vector3d> now(&xyz[3 * p]);
            const double error = (now - film.truth(lifted.of_film[p]).position).norm();
            if (status[p] == DEFREC_POINT_OBSERVED) CHECK(error <= 1);
            if (cuts > 0) errors.push_back(error);
        }
        if (i + 1 == kFrames) {
            // The cut is kept in a file.
            const TemporaryFolder folder;
            const std::string path = (folder.path() / "template").string();
            REQUIRE_OK(defrec_template_save(surface, path.c_str()));
            defrec_template loaded = nullptr;
            REQUIRE_OK(defrec_template_load(session.context, path.c_str(), &loaded));
            defrec_template_info kept;
            DEFREC_INIT(&kept);
            REQUIRE_OK(defrec_template_get(loaded, &kept));
            CHECK(kept.cut_point_count == info.cut_point_count);
            CHECK(kept.edge_count == info.edge_count);
            CHECK(std::equal(kept.triangles, kept.triangles + 3 * kept.triangle_count,
                             info.triangles));
            defrec_template_release(loaded);
        }
        defrec_template_release(surface);
        defrec_job_release(job);
    }
    CHECK(cuts >= 1);
    REQUIRE(errors.size() > 5 * lifted.of_film.size());
    std::sort(errors.begin(), errors.end());
    CHECK(errors[errors.size() / 2] < 0.15);
    CHECK(errors[errors.size() * 95 / 100] < 0.8);
}

TEST_CASE("a frame that is lost just as a cut is noticed shows the surface that was cut") {
    const CutFilm film;
    TrackingSession session("cpu", 2, film.describe());
    film.track_to_cut(session);
    std::vector<uint8_t> noise(film.images().left.size());
    uint32_t number = 1;
    for (uint8_t& value : noise) value = static_cast<uint8_t>((number *= 1664525u) >> 24);
    for (const bool is_first : {true, false}) {
        defrec_job job = track_images(session, noise, noise);
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        CHECK(result.state == DEFREC_LOST);
        CHECK(result.template_epoch == 2);
        CHECK(((result.reasons & DEFREC_REASON_CUT) != 0) == is_first);
        CHECK(farthest_from_warped(job) < 1e-3);
        defrec_job_release(job);
    }
}
