// Rendered tissue that comes apart, up to the frame in which the tracker notices it.
#pragma once
#include <vector>

#include "sdk/testing/test_film.hpp"
#include "sdk/testing/test_session.hpp"

namespace defrec::test {

class CutFilm {
  public:
    struct Images {
        std::vector<uint8_t> left, right;
    };

    CutFilm() {
        TrackingSession session("cpu", 2, describe());
        defrec_result result;
        DEFREC_INIT(&result);
        do {
            REQUIRE(frames_.size() < kFrames);
            film_.advance();
            frames_.push_back({film_.left_bgr(), film_.right_bgr()});
            const defrec_job job = track_film(session, film_);
            REQUIRE_OK(defrec_job_result(job, &result));
            defrec_job_release(job);
        } while ((result.reasons & DEFREC_REASON_CUT) == 0);
    }

    // For a session that tracks it.
    TrackingSession::Change describe() const {
        return [this](defrec_rig_desc& rig, defrec_tracker_desc& tracker) {
            describe_rig(film_.scene().rig, kWidth, kHeight, rig);
            tracker.format = DEFREC_FORMAT_BGR8;
        };
    }
    // All frames but the one in which the cut is noticed.
    void track_to_cut(TrackingSession& session) const {
        for (size_t i = 0; i + 1 < frames_.size(); ++i)
            defrec_job_release(track_images(session, frames_[i].left, frames_[i].right));
    }
    // The same frame.
    const Images& images() const { return frames_.back(); }

  private:
    static constexpr int kWidth = 640, kHeight = 360, kFrames = 30;
    cli::Film film_{"cut", kWidth, kHeight, kFrames, 1, 2};
    std::vector<Images> frames_;
};

}  // namespace defrec::test
