// The rig that films a rendered scene, as the C API takes it.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/scenes/film.hpp"
#include "sdk/testing/test_session.hpp"

namespace defrec::test {

inline defrec_intrinsics intrinsics_of(const cli::Lens& lens) {
    return {lens.fx, lens.fy, lens.cx, lens.cy, {}, 0, 0};
}

// The rig of a scene whose cameras are rectified and without distortion. width, height: of the
// film.
inline void describe_rig(const cli::StereoRig& filmed, uint32_t width, uint32_t height,
                         defrec_rig_desc& rig) {
    rig.width = width;
    rig.height = height;
    rig.left = intrinsics_of(filmed.left);
    rig.right = intrinsics_of(filmed.right);
    std::copy_n(filmed.translation.data(), 3, rig.translation);
}

// Follows a film of that rig on the CPU, in two threads.
inline TrackingSession session_of(const cli::Film& film, uint32_t width, uint32_t height) {
    return TrackingSession("cpu", 2, [&](defrec_rig_desc& rig, defrec_tracker_desc& tracker) {
        describe_rig(film.scene().rig, width, height, rig);
        tracker.format = DEFREC_FORMAT_BGR8;
    });
}

// The job, done, of two images. The session takes DEFREC_FORMAT_BGR8.
inline defrec_job track_images(TrackingSession& session, const std::vector<uint8_t>& left,
                               const std::vector<uint8_t>& right) {
    TrackingSession::Frame frame;
    frame.left.pixels = left.data();
    frame.right.pixels = right.data();
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit(frame, &job));
    REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
    return job;
}
// Likewise, of the film's frame.
inline defrec_job track_film(TrackingSession& session, const cli::Film& film) {
    return track_images(session, film.left_bgr(), film.right_bgr());
}
inline defrec_job track_next(TrackingSession& session, cli::Film& film) {
    film.advance();
    return track_film(session, film);
}

// The largest distance, mm, of a vertex of a frame's surface from where defrec_job_warp_points()
// has it: both are of one surface.
inline double farthest_from_warped(defrec_job job) {
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(job, &result));
    defrec_template surface = nullptr;
    REQUIRE_OK(defrec_job_get_template(job, &surface));
    defrec_template_info info;
    DEFREC_INIT(&info);
    REQUIRE_OK(defrec_template_get(surface, &info));
    REQUIRE(info.vertex_count == result.vertex_count);
    std::vector<double> xyz;
    for (uint64_t i = 0; i < info.vertex_count; ++i)
        xyz.insert(xyz.end(), info.vertices[i].position, info.vertices[i].position + 3);
    std::vector<double> warped(xyz.size());
    REQUIRE_OK(defrec_job_warp_points(job, xyz.data(), info.vertex_count, warped.data(), nullptr,
                                      nullptr));
    defrec_template_release(surface);
    double farthest = 0;
    for (size_t i = 0; i < warped.size(); i += 3)
        farthest = std::max(farthest, std::hypot(warped[i] - double{result.vertices[i]},
                                                 warped[i + 1] - double{result.vertices[i + 1]},
                                                 warped[i + 2] - double{result.vertices[i + 2]}));
    return farthest;
}

// The film's points that lie on a template's surface.
struct LiftedPoints {
    std::vector<double> xyz;      // template frame, mm
    std::vector<size_t> of_film;  // its point, of each
};
inline LiftedPoints lift_film(defrec_template surface, const cli::Film& film) {
    LiftedPoints lifted;
    for (size_t p = 0; p < film.points().size(); ++p) {
        const double pixel[2] = {film.points()[p].u, film.points()[p].v};
        double xyz[3];
        uint8_t found = 0;
        REQUIRE_OK(defrec_template_lift(surface, pixel, 1, xyz, &found));
        if (found == 0) continue;
        lifted.xyz.insert(lifted.xyz.end(), xyz, xyz + 3);
        lifted.of_film.push_back(p);
    }
    return lifted;
}

}  // namespace defrec::test
