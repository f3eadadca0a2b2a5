// Tissue whose texture hardly stands out from the noise, through the C API, on a rendered sequence
// with exact truth.
#include <doctest/doctest.h>

#include <vector>

#include "sdk/testing/test_film.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec;
using namespace defrec::test;

TEST_CASE("faint texture is followed from its first frame on, within its expected errors") {
    constexpr int kWidth = 960, kHeight = 540, kFrames = 8;
    cli::Film film("fat", kWidth, kHeight, kFrames, 31, 2, {});
    TrackingSession session = session_of(film, kWidth, kHeight);
    LiftedPoints lifted;
    size_t points = 0, observed = 0, within_two = 0, within_three = 0;
    for (int i = 0; i < kFrames; ++i) {
        CAPTURE(i);
        defrec_job job = track_next(session, film);
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        REQUIRE((result.state == DEFREC_TRACKING || result.state == DEFREC_DEGRADED));
        CHECK(result.template_epoch == 1);
        if (i == 0) {
            defrec_template surface = nullptr;
            REQUIRE_OK(defrec_job_get_template(job, &surface));
            lifted = lift_film(surface, film);
            defrec_template_release(surface);
            REQUIRE(lifted.of_film.size() > 150);
        }
        std::vector<double> xyz(lifted.xyz.size()), expected(lifted.of_film.size());
        std::vector<uint8_t> status(lifted.of_film.size());
        REQUIRE_OK(defrec_job_warp_points(job, lifted.xyz.data(), status.size(), xyz.data(),
                                          status.data(), expected.data()));
        for (size_t p = 0; p < status.size(); ++p) {
            const auto truth = film.truth(lifted.of_film[p]);
            if (!truth.visible) continue;
            ++points;
            if (status[p] != DEFREC_POINT_OBSERVED) continue;
            const double error =
                (Eigen::Map<const Eigen::Vector3d>(&xyz[3 * p]) - truth.position).norm();
            ++observed;
            within_two += error <= 2 * expected[p] ? 1 : 0;
            within_three += error <= 3 * expected[p] ? 1 : 0;
            CHECK(error <= 2.5);
        }
        defrec_job_release(job);
    }
    REQUIRE(points > 1000);
    CHECK(observed > points / 4);
    CHECK(within_two > 0.93 * static_cast<double>(observed));
    CHECK(within_three > 0.98 * static_cast<double>(observed));
}
