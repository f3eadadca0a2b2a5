// Places of all that is followed when its frame is shown, and display.csv.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <unordered_map>
#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/session/frame_projection.hpp"
#include "sdk/session/moved_points.hpp"
#include "sdk/session/plan_follower.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {

// When a frame was taken, and what became of it: fields of defrec_result.
struct FrameOutcome {
    std::int64_t timestamp_ns = 0;
    std::uint32_t state = 0, epoch = 0;
};

// Points that are the same in all frames. One thread at a time.
class PointPredictor {
  public:
    PointPredictor(std::size_t count, double delay_ms);

    // Tells where the points are in a frame, and moves them to the time of display, with errors and
    // covariances that have grown. basis: DEFREC_PREDICTED_*.
    void move(const FrameOutcome& frame, MovedPoints& points, std::vector<std::uint8_t>& basis);

  private:
    const std::int64_t delay_ns_;
    Predictor predictor_;
    std::vector<double> before_;  // errors in the frame
};

// Rows of points that come and go, each of which has a number of its own. One thread at a time.
class RowPredictor {
  public:
    RowPredictor(double delay_ms, RawProjection& projection)
        : delay_ms_(delay_ms), projection_(projection) {}

    // Moves the rows; slots: the number of each, as small as can be. Says what each rests on. Where
    // more points come than there was room for, the motion of all is forgotten.
    std::vector<std::uint8_t> move(const FrameOutcome& frame, const std::vector<PositionRow*>& rows,
                                   const std::vector<std::size_t>& slots);

  private:
    const double delay_ms_;
    RawProjection& projection_;
    std::unique_ptr<PointPredictor> predictor_;
    MovedPoints points_;
};

// One thread at a time.
class DisplayPrediction {
  public:
    // Creates the file under its temporary name. Borrows the projection.
    DisplayPrediction(const std::filesystem::path& path, double delay_ms,
                      RawProjection& projection);

    // A frame's rows at the time of display, which are written; each at most once a frame.
    std::vector<PointRow> move(const FrameOutcome& frame, std::vector<PointRow> rows);
    std::vector<TargetRow> move(const FrameOutcome& frame, std::vector<TargetRow> rows);
    // Its points are borrowed until the next call.
    PlanFrame move(const FrameOutcome& frame, PlanFrame plan);
    void commit() { file_.commit(); }

  private:
    template <class Row, class Finish>
    void move_rows(const FrameOutcome& frame, RowPredictor& predictor, std::vector<Row>& rows,
                   const std::vector<std::size_t>& slots, Finish&& finish);

    const double delay_ms_;
    RawProjection& projection_;
    DisplayFile file_;
    RowPredictor points_, targets_, plan_rows_;
    std::unordered_map<std::int64_t, std::size_t> slots_;  // of points, by id
    std::unique_ptr<PointPredictor> plan_predictor_;
    MovedPoints plan_;
};

}  // namespace defrec::cli
