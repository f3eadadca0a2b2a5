// A flap that is lifted on its hinge and laid back, and whole tissue that is pulled out, through
// the C API, on rendered sequences with exact truth.
#include <doctest/doctest.h>

#include <optional>
#include <vector>

#include "sdk/testing/test_film.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

constexpr int kFilmWidth = 640, kFilmHeight = 360, kFrames = 34;
// The flap is lifted from frame 4 on and lies again in frame 36; between these frames it is seen so
// obliquely that no patch of it can be compared.
constexpr int kParted = 10, kOblique = 15, kSeenAgain = 28;
constexpr double kLifted = 5;  // mm, from where a point was
// In these frames an instrument pulls the tissue out until its sides are as steep as a flap's.
constexpr int kPulledFrames = 40, kPulled = 26;

defrec_result result_of(defrec_job job) {
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(job, &result));
    return result;
}

uint64_t cut_points_of(defrec_job job) {
    defrec_template surface = nullptr;
    REQUIRE_OK(defrec_job_get_template(job, &surface));
    defrec_template_info info;
    DEFREC_INIT(&info);
    REQUIRE_OK(defrec_template_get(surface, &info));
    const uint64_t count = info.cut_point_count;
    defrec_template_release(surface);
    return count;
}

// The film's points on the surface of its first frame.
struct FilmPoints {
    LiftedPoints lifted;
    std::vector<Eigen::Vector3d> first;  // where each was in it

    FilmPoints(defrec_job job, const cli::Film& film) {
        defrec_template surface = nullptr;
        REQUIRE_OK(defrec_job_get_template(job, &surface));
        lifted = lift_film(surface, film);
        defrec_template_release(surface);
        for (const size_t p : lifted.of_film) first.push_back(film.truth(p).position);
    }

    // Points of the flap, while it is up, that are seen; and those of them that are followed.
    struct Counts {
        size_t up = 0, followed = 0;
    };
    Counts count(defrec_job job, const cli::Film& film) const {
        std::vector<double> xyz(lifted.xyz.size()), expected(lifted.of_film.size());
        std::vector<uint8_t> status(lifted.of_film.size());
        REQUIRE_OK(defrec_job_warp_points(job, lifted.xyz.data(), status.size(), xyz.data(),
                                          status.data(), expected.data()));
        Counts counts;
        for (size_t p = 0; p < status.size(); ++p) {
            const auto truth = film.truth(lifted.of_film[p]);
            const Eigen::Map<const Eigen::Vector3d> now(&xyz[3 * p]);
            const double error = (now - truth.position).norm();
            if (status[p] == DEFREC_POINT_OBSERVED) CHECK(error <= 2.5);
            if (!truth.visible || (truth.position - first[p]).norm() < kLifted) continue;
            ++counts.up;
            if (status[p] != DEFREC_POINT_UNKNOWN && error <= 1) ++counts.followed;
        }
        return counts;
    }
};

cli::Film film_of_flap() {
    return cli::Film("flap", kFilmWidth, kFilmHeight, kFrames, 5, 2,
                     {{"angle", 75}, {"length", 24}, {"instrument", 0}});
}

}  // namespace

TEST_CASE("a flap is parted from what it came off, followed, and found again as it comes back") {
    cli::Film film = film_of_flap();
    TrackingSession session = session_of(film, kFilmWidth, kFilmHeight);
    std::optional<FilmPoints> points;
    uint32_t cuts = 0;
    size_t up = 0, followed = 0;  // in the frames in question
    for (int i = 0; i < kFrames; ++i) {
        CAPTURE(i);
        defrec_job job = track_next(session, film);
        const defrec_result result = result_of(job);
        CHECK((result.state == DEFREC_TRACKING || result.state == DEFREC_DEGRADED));
        cuts += (result.reasons & DEFREC_REASON_CUT) != 0 ? 1 : 0;
        CHECK(result.template_epoch == 1 + cuts);
        CHECK((cut_points_of(job) > 0) == (cuts > 0));
        if (i < kParted - 5) CHECK(cuts == 0);
        if (i == kParted) CHECK(cuts > 0);
        if (i == 0) points.emplace(job, film);
        const FilmPoints::Counts counts = points->count(job, film);
        if ((i >= kParted && i < kOblique) || i >= kSeenAgain) {
            up += counts.up;
            followed += counts.followed;
        }
        defrec_job_release(job);
    }
    REQUIRE(up > 150);
    CHECK(followed > up / 2);
}

TEST_CASE("a flap that moved on while no frame was seen is not thrown on by all of that way") {
    constexpr int kDark = kParted + 1, kSeen = kDark + 2;
    cli::Film film = film_of_flap();
    TrackingSession session = session_of(film, kFilmWidth, kFilmHeight);
    const std::vector<uint8_t> dark(size_t{3} * kFilmWidth * kFilmHeight, 0);
    std::optional<FilmPoints> points;
    for (int i = 0; i <= kSeen + 1; ++i) {
        CAPTURE(i);
        const bool is_dark = i >= kDark && i < kSeen;
        film.advance();
        defrec_job job = is_dark ? track_images(session, dark, dark) : track_film(session, film);
        CHECK((result_of(job).state == DEFREC_LOST) == is_dark);
        if (i == 0) points.emplace(job, film);
        const FilmPoints::Counts counts = points->count(job, film);
        if (is_dark) CHECK(farthest_from_warped(job) < 1e-3);
        if (i >= kSeen) {
            REQUIRE(counts.up > 20);
            CHECK(counts.followed > counts.up / 2);
        }
        defrec_job_release(job);
    }
}

TEST_CASE("tissue that an instrument pulls out is not parted") {
    cli::Film film("grasp", kFilmWidth, kFilmHeight, kPulledFrames, 7, 2);
    TrackingSession session = session_of(film, kFilmWidth, kFilmHeight);
    for (int i = 0; i < kPulled; ++i) {
        CAPTURE(i);
        defrec_job job = track_next(session, film);
        const defrec_result result = result_of(job);
        CHECK(result.state == DEFREC_TRACKING);
        CHECK((result.reasons & DEFREC_REASON_CUT) == 0);
        CHECK(result.template_epoch == 1);
        if (i + 1 == kPulled) CHECK(cut_points_of(job) == 0);
        defrec_job_release(job);
    }
}
