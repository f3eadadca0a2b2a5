// The numbers by which points are predicted to the time of display, as scripts/decisions/header.py
// reads them: unit | what it decides | source.
#pragma once
#include <cstddef>

namespace defrec::decisions {

// The grid of times on which motion is learned and predicted: steps back from the last frame, and
// ahead of it.
struct PredictionGrid {
    // s | the step is the multiple of the frames' interval that is next to it | a frame of most
    //   cameras
    static constexpr double kStep = 1.0 / 30;
    // steps | of motion that a prediction is made of | 0.8 s, a beat; 16 were worse, 32 no better:
    //   docs/experiments/2026-11-28-time-of-display.md
    static constexpr int kLags = 24;
    // frames | whose median interval is the interval; in as many in a row it has changed before
    //   another step is chosen | set by hand: where every third frame is missing it swings
    static constexpr std::size_t kIntervals = 25;
    // 1 | change of the interval at which another step is chosen, and learning begins again | set
    //   by hand: most times of the grid then lie between frames
    static constexpr double kRateChange = 0.1;
    // steps | a frame this near to a time of the grid is taken as it is | rounding of time stamps
    static constexpr double kSame = 1e-3;
    // steps | that the last horizon may fall short of the latest time of display | rounding
    static constexpr double kShort = 0.05;
    // frames | interval beyond which motion is forgotten | set by hand: interpolation over two
    //   missing frames adds less than the error of the prediction
    static constexpr double kMaxGap = 3.5;
    // s | likewise, at least | set by hand
    static constexpr double kMinGap = 0.1;
    // mm | a coordinate beyond it is refused | set by hand: squares of what is no place would hide
    //   all others for minutes
    static constexpr double kFarthest = 1e6;
    // frames | that are kept at most | 300 frames/s; above, nothing is learned
    static constexpr std::size_t kMaxFrames = 300;
};

// The coefficients that all points share.
struct PredictionLearning {
    // points | evenly spread, from which is learned | 600 equations a frame for 24 unknowns
    static constexpr std::size_t kPoints = 200;
    // s | after which an equation counts 1/e | 0.98 a frame of 30 frames/s; 0.95 to 0.99 were alike
    static constexpr double kMemory = 1.65;
    // 1 | weight of the damped velocity, of the mean diagonal of the normal equations | 0.0001 to
    //   0.01 were alike
    static constexpr double kPrior = 0.001;
    // mm^2 | the diagonal, at least | rounding of positions
    static constexpr double kRest = 1e-9;
    // s | in which a velocity fades to 1/e | 4 frames of 30 frames/s
    static constexpr double kDamping = 4.0 / 30;
};

// Errors of past predictions, from which the expected error and the basis follow.
struct PredictionMemory {
    // s | memory of a point's squared error | weight 0.1 a frame of 30 frames/s
    static constexpr double kOwn = 0.316;
    // s | of the mean of all points | weight 0.2
    static constexpr double kAll = 0.149;
    // s | of the mean by which the basis is chosen | set by hand: most of a beat
    static constexpr double kChoice = 0.65;
    // s | that a frame adds to a memory, at most | after a gap the past still counts
    static constexpr double kMaxAge = 0.1;
    // mm/s | of tissue, before any prediction was judged | rms of the scene heartbeat
    static constexpr double kUnknownSpeed = 30;
};

// A step of a point from one frame to the next that no motion explains.
struct PredictionJumps {
    // 1 | times the rms motion of all points in as much time | set by hand: a beat's largest is 3
    static constexpr double kRatio = 5;
    // mm | and at least | set by hand
    static constexpr double kMin = 2;
};

}  // namespace defrec::decisions
