// A lag of the right view that lasts: over about a second its rows and its disparities change as
// the tissue moves. A single frame whose tissue moves along the rows shows none.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include "sdk/tracking/decisions/rig.hpp"

namespace defrec {

// A piece of tissue that is seen in both views.
struct RowMatch {
    static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

    double x, y;               // in the left view, px from the image's centre
    double step;               // row in the right view less that in the left, px
    double speed;              // of the row in the left view, px per frame; 0 where it is not known
    double turn = 0;           // step for a radian by which the right view is turned, px
    double along = kUnknown;   // speed of the column in the left view, px per frame
    double growth = kUnknown;  // of its disparity since the frame before, px
};

// Offset, growth along x and along y, and turn of the right view's rows, and its lag.
using RowValues = Eigen::Matrix<double, 5, 1>;
using RowInformation = Eigen::Matrix<double, 5, 5>;

// Information on them, and times their mean.
struct RowKnowledge {
    RowInformation information = RowInformation::Zero();
    RowValues weighted = RowValues::Zero();
};

class LastingLag {
  public:
    // A frame's matches, in the order of the frames. known: from the frames before and the rig;
    // start: the values of the frame, about; is_late: it shows its lag by itself.
    void add_frame(std::span<const RowMatch> matches, const RowKnowledge& known,
                   const RowValues& start, bool is_late);
    // The next frame does not follow on the last, or its disparities are others.
    void break_off() { frames_ = 0; }

    // Frames, as the frames up to now show it; 0: none that shows.
    double lag() const { return lag_; }
    // Frames that the view may be late by without being seen, root mean square.
    double unseen() const { return is_seen_ ? 0 : unseen_; }
    // On the values, by all frames together.
    const RowKnowledge& rows() const { return rows_; }
    // The image's middle along the rows in the last frame, px per frame; 0: not known.
    double speed() const {
        return frames_ > 0 ? course_[(frames_ - 1) % decisions::LastingLag::kWindow].speed : 0;
    }

    struct Estimate {
        double lag = 0, sigma = std::numeric_limits<double>::infinity();
    };

  private:
    // The motion of the image's middle, summed up since the first of the frames.
    struct Course {
        double disparity = 0, along = 0, down = 0;  // px
        double scale = 0;                           // %
        double speed = 0;                           // along the rows, px per frame
    };

    struct Motion;
    static std::optional<Motion> motion_of(std::span<const RowMatch> matches);
    static RowKnowledge rows_of(std::span<const RowMatch> matches, const Motion& motion,
                                const RowKnowledge& known, RowValues values);
    void restart_where_other(const Estimate& now, bool is_sure);
    void add_course(const Motion& motion);
    Estimate by_rows() const;
    Estimate by_depth() const;
    void judge();
    void decide(double lag);

    RowKnowledge rows_;
    // The last of these frames_, at frame % kWindow.
    std::array<Course, decisions::LastingLag::kWindow> course_{};
    size_t frames_ = 0;
    double lag_ = 0;
    double begun_ = 0;  // the lag, or until it is decided that of the frame that began another
    double unseen_ = decisions::LastingLag::kUnseen;  // unless is_seen_
    bool is_seen_ = false;
};

}  // namespace defrec
