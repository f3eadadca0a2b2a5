// The numbers by which `defrec calibrate` decides, as scripts/decisions/header.py reads them: unit
// | what it decides | source.
#pragma once

namespace defrec::decisions {

// Which frames of a recording are used.
struct BoardFrames {
    // frames | of a recording are searched for the board at most, evenly spread | set by hand: a
    //     minute or two of computation at 1080p
    static constexpr int kMaxSearched = 240;
    // corners | a view with fewer is not used | set by hand: three times what a pose needs
    static constexpr int kMinCorners = 12;
    // 1 | half of the window in which a corner is refined, as a share of the distance to
    //     the nearest corner | within the squares around it, tilted as well
    static constexpr double kWindow = 0.35;
    // px | but at least, at most | OpenCV's practice; larger ones bend with the lens
    static constexpr int kMinWindow = 2, kMaxWindow = 8;
    // times the sharpness of the sharpest quarter | frames below are too blurred | set by hand:
    //     corners of a view that is half as sharp are twice as uncertain
    static constexpr double kMinSharpness = 0.5;
    // poses | at most as many are used | set by hand: time grows with them, precision by the root
    static constexpr int kMaxPoses = 48;
    // 1 | a pose nearer to one that is used adds nothing: distance in parts of the image's width,
    //     in doublings of the size and in units of 30 degrees of tilt | set by hand: neighbours of
    //     a video differ by a tenth of it
    static constexpr double kMinDistance = 0.05;
};

// What is fitted.
struct BoardFit {
    // times the median | a frame whose residual is larger is left out | set by hand: motion between
    //     the views and blur come in single frames
    static constexpr double kMaxFrameResidual = 2.5;
    // px | but no frame below | set by hand: a rendered board has 0.03
    static constexpr double kMinFrameResidual = 0.1;
    // rounds | of leaving out, at most | set by hand
    static constexpr int kRounds = 4;
};

// Whether a calibration may be used.
struct BoardVerdict {
    // pairs | with fewer it is refused | set by hand: five coefficients of distortion leave three
    //     tilts no redundancy
    static constexpr int kMinPairs = 8;
    // px | a larger residual, root mean square over both views, is refused | docs: 0.5 is good
    static constexpr double kMaxResidual = 1.0;
    // px | rows of both views that disagree by more, root mean square, are refused | stereo
    //     searches along one row
    static constexpr double kMaxRows = 0.7;
    // 1 | a focal length whose standard deviation is a larger share is refused | set by hand: depth
    //     is wrong by as much
    static constexpr double kMaxFocalError = 0.01;
    // cells | across and down in which coverage is counted | set by hand
    static constexpr int kCellsAcross = 8, kCellsDown = 6;
    // 1 | a warning where boards covered a smaller share of a view | set by hand: a view whose
    //     border of one cell is not covered has 0.5
    static constexpr double kMinCoverage = 0.7;
    // corners | of a region, with fewer its rows are not judged | set by hand
    static constexpr int kMinRegionCorners = 10;
    // degrees | a warning where no board was tilted by more | the guide asks for 20 to 45
    static constexpr double kMinTilt = 15;
};

}  // namespace defrec::decisions
