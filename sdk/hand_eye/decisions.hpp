// The numbers by which a hand-eye calibration decides, as scripts/decisions/header.py reads them:
// unit | what it decides | source.
#pragma once
#include <cstddef>

namespace defrec::decisions {

// Poses that are taken.
struct HandEyePoses {
    // poses | fewer are refused | two motions about different axes fix the transform
    static constexpr size_t kMinPoses = 3;
    // poses | of more as many are used, evenly spread | set by hand: neighbours share errors
    static constexpr size_t kMaxPoses = 2000;
    // 1 | an element of R R^T - 1, at most | files round to six digits
    static constexpr double kRotation = 1e-3;
    // median intervals | between two poses, beyond which nothing is interpolated | set by hand
    static constexpr double kMaxGap = 4;
    // s | likewise, at least | set by hand: a hand turns by 2 degrees in it
    static constexpr double kMinGap = 0.1;
};

// Errors of poses that are not stated; the residuals then say how large they are.
struct HandEyeNoiseStart {
    // mm | of a place, along each axis | set by hand
    static constexpr double kPlace = 0.2;
    // rad | of a rotation, about each axis: 0.1 degree | set by hand
    static constexpr double kTurn = 0.001745;
    // 1 | a round changes them by no smaller factor, and no larger one than its inverse | set by
    //   hand: no error becomes 0 where another explains all
    static constexpr double kMinChange = 0.5;
    // rounds | in which they are estimated from the residuals | they are at rest after 6
    static constexpr int kRounds = 8;
};

// Whether the poses turn enough, before anything is solved.
struct HandEyeMotion {
    // rad | root mean square of the rotations against their mean; less: too little rotation |
    //   set by hand: 2 degrees
    static constexpr double kMinTurn = 0.035;
    // rad | that of their parts across the main axis; less: all are about one axis | likewise
    static constexpr double kMinCross = 0.035;
    // times the error of a rotation | both, at least | set by hand
    static constexpr double kNoiseRatio = 5;
};

// The closed form from which the least squares start.
struct HandEyeStart {
    // subsets of three poses | that are tried | with a third of outliers each is clean by 0.3
    static constexpr int kSubsets = 300;
    // poses | with which a subset is judged | set by hand
    static constexpr size_t kJudges = 200;
    // poses | whose relative motions enter the closed form, at most | set by hand
    static constexpr size_t kMaxPoses = 40;
    // rad | a larger relative rotation has no clear axis | set by hand: 160 degrees
    static constexpr double kMaxTurn = 2.8;
    // rad | a smaller one says nothing of an axis | set by hand: half a degree
    static constexpr double kMinTurn = 0.0087;
    // 1 | seed of the subsets | set by hand
    static constexpr unsigned kSeed = 20;
};

// Least squares, and which poses count in them.
struct HandEyeFit {
    // expected errors | a pose whose error is larger is an outlier | 1 of 500 by chance, of 6 parts
    static constexpr double kInlier = 4.56;
    // expected errors | median of the errors, of 6 parts | chi distribution
    static constexpr double kMedian = 2.313;
    // poses | over those that the transform leaves free: by so much a median of few is enlarged |
    //   Rousseeuw and Leroy 1987
    static constexpr double kSmallSample = 5;
    // rounds | of least squares and choice of outliers | it is at rest after 4
    static constexpr int kRounds = 12;
    // steps | of least squares | it is at rest after 5
    static constexpr int kSteps = 20;
    // mm | a smaller step of the scaled motion is the last one | rounding
    static constexpr double kRest = 1e-7;
    // mm | distance at which a turn is measured as a shift | working distance of an endoscope
    static constexpr double kLength = 100;
    // share of the largest information | keeps the normal equations invertible | rounding
    static constexpr double kDamping = 1e-13;
    // standard deviations | of chi^2 above which the residuals enlarge the covariance | set by hand
    static constexpr double kMinChange = 3;
    // 1 | a smaller correlation between residuals of poses ends the sum | chance
    static constexpr double kFaded = 0.05;
    // poses | with fewer no correlation is looked for | set by hand
    static constexpr size_t kMinCorrelated = 50;
};

// Whether the transform may be used.
struct HandEyeVerdicts {
    // share of the poses | that fit; less: failed | half of them may be wrong
    static constexpr double kMinInliers = 0.55;
    // mm | standard deviation in the covariance along what is undetermined | set by hand: of no use
    static constexpr double kExpected = 1000;
    // times the error otherwise | of poses the other way round, at most: they are inverted | set by
    //   hand: right ones fit ten times better
    static constexpr double kInverted = 0.4;
    // 1 | lengths that differ by a smaller share are not told | set by hand
    static constexpr double kLengths = 0.005;
    // standard deviations | likewise | 1 of 370 by chance
    static constexpr double kLengthsSure = 3;
    // 1 | lengths that differ by a larger share are another unit | set by hand
    static constexpr double kOtherUnit = 0.2;
};

// The offset between two clocks, by the correlation of rotation speeds.
struct HandEyeOffset {
    // s | over which a speed is measured | set by hand: a hand turns by 5 degrees in it
    static constexpr double kWindow = 0.25;
    // s | both streams overlap at least, at any offset that is tried | set by hand
    static constexpr double kMinOverlap = 3;
    // s | length of the camera's stream, at most | set by hand: an hour
    static constexpr double kMaxLength = 3600;
    // s | grid of the correlation, at least | set by hand
    static constexpr double kMinStep = 0.01;
    // median intervals | of the grid in kWindow, at least; slower streams are refused | set by hand
    static constexpr double kMinSamples = 2;
    // poses | of a stream with fewer none is left out | set by hand
    static constexpr size_t kMinSpikes = 10;
    // times the median | turn of a pose against those beside it, beyond which it is left out | set
    //   by hand: it is noise, or bends of the motion
    static constexpr double kSpikeRatio = 6;
    // rad | likewise, at least | set by hand: one degree
    static constexpr double kMinSpike = 0.0175;
    // times the median speed | a faster one counts as that | wrong poses seem to be fast
    static constexpr double kMostSpeed = 3;
    // 1 | correlation, at least | chance in 20 s of noise, over all offsets: 0.6
    static constexpr double kMinCorrelation = 0.75;
    // 1 | lead over every other peak, at least | set by hand
    static constexpr double kMinLead = 0.05;
    // of the variance of all speeds | that of those which overlap; less: they do not change |
    //   rounding
    static constexpr double kMinVariance = 1e-9;
    // s | half the span over which a pose's speed is measured for the least squares | set by hand
    static constexpr double kSpan = 0.05;
};

}  // namespace defrec::decisions
