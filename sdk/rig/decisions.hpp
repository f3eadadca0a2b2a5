// The numbers by which a calibration is refused or doubted, as scripts/decisions/header.py reads
// them: unit | what it decides | source.
#pragma once

namespace defrec::decisions {

// The limits that a calibration must fulfil.
struct RigLimits {
    // focal lengths | along a side of the image, at most | set by hand
    static constexpr double kMaxSide = 50;
    // sides of the image | a longer focal length is refused | set by hand
    static constexpr double kMaxFocalLength = 1000;
    // sides of the image | a principal point farther before its first pixel is refused | set by
    //   hand
    static constexpr double kMaxBefore = 1;
    // sides of the image | or one farther beyond that pixel | set by hand
    static constexpr double kMaxBeyond = 2;
    // share of both sides | from the image's middle, in the same direction of both, beyond which a
    //   principal point is doubted | a calibration of images of another size puts it at half of
    //   their ratio: 1280 for 1920 px at a third
    static constexpr double kFarOff = 0.05;
    // times | of focal lengths along both sides, or of both views, beyond which they are doubted |
    //   square pixels, a pair of equal cameras; fields of interlaced video have 2
    static constexpr double kFarApart = 1.1;
    // times | of focal lengths along both sides, beyond which they are refused | set by hand
    static constexpr double kTooFarApart = 4;
    // rad | by which a sensor may be tilted | set by hand
    static constexpr double kMaxTilt = 1;
    // share of the image | beyond a fold of the distortion; more is refused | coefficients fold at
    //   the corners, where a calibration has no data; less than half left is more likely an error
    static constexpr double kMaxFoldedShare = 0.5;
    // 1 | an element of R^T R - 1, at most | set by hand
    static constexpr double kRotationTolerance = 1e-3;
    // mm | a shorter baseline is refused | set by hand
    static constexpr double kMinBaseline = 0.1;
    // mm | a longer one is refused | set by hand
    static constexpr double kMaxBaseline = 10000;
    // degrees | by which the cameras may look apart | set by hand
    static constexpr double kMaxTurn = 60;
    // degrees | from the x axis to the baseline, at most | set by hand
    static constexpr double kMaxSlope = 30;
};

// Cameras that look at one place: a stereo microscope, or an endoscope with toe-in.
struct Convergence {
    // share of the width | disparity of what both views see in their middle, up to which they share
    //   a principal point | da Vinci endoscopes of the public data sets have at most 0.07
    static constexpr double kShared = 0.1;
    // share of the width | of disparity is left for tissue behind that place; so much of the left
    //   view is seen by it alone | a microscope 300 mm away that is focused on the tissue's far
    //   side
    static constexpr double kBehind = 0.03;
    // share of the view's width in mm | or so far behind that place tissue may lie, whichever is
    //   more | the relief of a field is a fraction of its width; views that converge by 12 degrees
    //   take 5 % of the width for it
    static constexpr double kRelief = 0.25;
};

}  // namespace defrec::decisions
