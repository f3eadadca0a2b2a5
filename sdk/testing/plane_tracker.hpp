// A tracker of the moving plane of test_scene.hpp, its template, and jobs with it.
#pragma once
#include <algorithm>

#include "sdk/testing/test_session.hpp"

namespace defrec::test {

class PlaneTracker {
  public:
    explicit PlaneTracker(uint32_t body = DEFREC_BODY_ON)
        : session_("cpu", 2,
                   [&](defrec_rig_desc&, defrec_tracker_desc& desc) { desc.body = body; }) {
        defrec_job_release(track(0, 0));
        REQUIRE_OK(defrec_tracker_get_template(session_.tracker, &surface_));
    }
    ~PlaneTracker() { defrec_template_release(surface_); }
    PlaneTracker(const PlaneTracker&) = delete;
    PlaneTracker& operator=(const PlaneTracker&) = delete;

    defrec_template surface() const { return surface_; }

    using Change = TrackingSession::ChangeFrame;
    // A frame in which the plane has moved by that, mm.
    defrec_status submit(double dx, double dy, defrec_job* job, const Change& change = nullptr) {
        return submit(render(dx, dy), job, change);
    }
    defrec_status submit(const Pair& pair, defrec_job* job, const Change& change = nullptr) {
        return session_.submit({{pair.left.data()}, {pair.right.data()}, {}}, job, change);
    }
    // A frame in which nothing is seen.
    defrec_job lose() {
        Pair dark = render(0, 0);
        std::fill(dark.left.begin(), dark.left.end(), uint8_t{0});
        std::fill(dark.right.begin(), dark.right.end(), uint8_t{0});
        defrec_job job = nullptr;
        REQUIRE_OK(submit(dark, &job));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        return job;
    }
    defrec_job track(double dx, double dy, const Change& change = nullptr) {
        defrec_job job = nullptr;
        REQUIRE_OK(submit(dx, dy, &job, change));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        return job;
    }

  private:
    TrackingSession session_;
    defrec_template surface_ = nullptr;
};

}  // namespace defrec::test
