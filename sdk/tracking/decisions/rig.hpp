// The numbers by which the tracker decides how both views lie to each other: turned, late, moved
// sideways, zoomed, as scripts/decisions/header.py reads them: unit | what it decides | source.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace defrec::decisions {

// How the right view lies against the left, from the rows of patches that both show.
struct RigRows {
    // corrections | of the rig, in a frame that captures a template; each is measured anew | set by
    //   hand
    static constexpr int kMostCorrections = 2;
    // occasions | the longest pause after searches for exchanged views that found none | set by
    // hand
    static constexpr uint32_t kLongestPause = 32;
    // matches | a frame with fewer is not measured | set by hand
    static constexpr size_t kMinMatches = 30;
    // px | standard deviation of a match's rows, at least; that of the frame's matches where it is
    //   larger | set by hand
    static constexpr double kStepSigma = 0.3;
    // 1 | share of the information of a frame's matches that counts: they err alike where stereo's
    //   windows or compression do | set by hand
    static constexpr double kIndependentShare = 0.2;
    // cells | across the image's longer side: matches in one lie side by side | blocks of 16 px in
    //   an image of 640, [shared-noise]
    static constexpr size_t kCellsAcross = 32;
    // pairs | of matches side by side that share no noise, before anything is known | the noise of
    //   the first frame, [shared-noise]
    static constexpr double kPriorPairs = 8;
    // px | standard deviation of the vertical offset before anything is known | set by hand
    static constexpr double kPriorOffset = 20;
    // rad | likewise of the roll | set by hand
    static constexpr double kPriorRoll = 0.05;
    // 1 | likewise of the ratio of focal lengths | set by hand
    static constexpr double kPriorRatio = 0.05;
    // px | width of Tukey's kernel in each step of the fit with a lag | set by hand
    static constexpr std::array<double, 6> kTukeyWidths = {24, 12, 6, 3, 1.5, 1.5};
    // px | likewise of the fit without a lag, which begins from there | set by hand
    static constexpr std::array<double, 3> kNextTukeyWidths = {3, 1.5, 1.5};
    // per frame | share of its weight that a frame keeps | about a second
    static constexpr double kMemory = 0.97;
    // px RMS | rows that disagree by more are `DEFREC_REASON_CALIBRATION` | set by hand
    static constexpr double kMaxRowError = 0.4;
    // matches | behind such an error, at least | three frames' `min_matches`
    static constexpr size_t kMinRowMatches = 90;
    // px RMS | more is corrected, where that is asked for | set by hand
    static constexpr double kCorrectedRowError = 0.15;
    // rad | standard deviation of the vergence before anything is known | set by hand
    static constexpr double kPriorVergence = 0.05;
    // rad | a larger vergence is `DEFREC_REASON_CALIBRATION` | at most 0.0015 in rendered sequences
    //   without one, 0.0025 +- 0.0025 in a beating heart, [late-along-rows]
    static constexpr double kMaxVergence = 0.002;
    // rad | a larger one is corrected, where that is asked for | set by hand
    static constexpr double kCorrectedVergence = 0.001;
    // standard deviations | of a vergence that counts, at least | set by hand
    static constexpr double kVergenceSignificance = 3;
};

// Whether the right view is late or early.
struct ViewLag {
    // mm | a right view that is late errs by more than this in depth: the frame is registered by
    //   the left view alone, which errs so | set by hand
    static constexpr double kOneViewError = 1.5;
    // frames | standard deviation of the lag before anything is known | set by hand
    static constexpr double kLagSigma = 1.5;
    // frames | a smaller lag is 0 | the noise of a rig that is right
    static constexpr double kMinLag = 0.12;
    // standard deviations | of a lag that counts, at least | set by hand
    static constexpr double kSignificance = 5;
    // matches | around each one, whose speeds must show the lag as well | set by hand
    static constexpr size_t kNeighbours = 6;
    // standard deviations | of the lag that they show, at least | 5.2 where a view is late, 2 where
    //   none is, [jumps]
    static constexpr double kSignificanceAround = 4;
};

// Whether the right view is late or early all the time, from what a second's frames show together.
// Source: `sideways` and the sequences without a lag of [late-along-rows], unless said otherwise
struct LastingLag {
    // frames | in which depth is compared with speed, at most | 2 s
    static constexpr size_t kWindow = 60;
    // frames | at least | five values are fitted
    static constexpr size_t kMinFrames = 12;
    // matches | of which the motion is known, at least | set by hand
    static constexpr double kMinMatches = 24;
    // px | width of Tukey's kernel in each step of a fit to the motion of the matches | set by hand
    static constexpr std::array<double, 6> kMotionWidths = {48, 24, 12, 6, 3, 2};
    // px | likewise to the growth of their disparities | set by hand
    static constexpr std::array<double, 5> kGrowthWidths = {12, 6, 3, 1.5, 1};
    // frames | standard deviation of a lag by rows, up to which they decide
    static constexpr double kSeenByRows = 0.15;
    // frames | by which a frame's own lag must differ, at least, to be another one
    static constexpr double kChange = 0.25;
    // frames | standard deviation of a lag by depth, up to which it decides where rows do not
    static constexpr double kSeenByDepth = 0.15;
    // frames | a smaller lag by depth is 0 | at most 0.2 where no view is late, 0.42 in `approach`,
    //   where rows decide
    static constexpr double kMinByDepth = 0.35;
    // standard deviations | of a lag by depth, at least | 3.5 in `approach`
    static constexpr double kSignificanceByDepth = 4;
    // px | standard deviation of the first disparity, which is not known | set by hand
    static constexpr double kPriorDisparity = 100;
    // px of disparity per px | likewise of what a change of place changes | a slope of 70 degrees
    static constexpr double kPriorByPlace = 0.2;
    // px of disparity per % | likewise of what a change of scale changes | disparities of 200 px
    static constexpr double kPriorByScale = 2;
    // px | a mean disparity errs by this at least | 0.02 in rendered sequences
    static constexpr double kLeastNoise = 0.03;
    // 1 | correlation of neighbouring residuals, at most | set by hand
    static constexpr double kMostAlike = 0.95;
    // steps | in which the noise is found | set by hand
    static constexpr int kNoiseSteps = 3;
    // frames | standard deviation of a lag that nothing has shown yet, for the expected error | a
    //   view that is a frame late errs by less than twice that, [late-along-rows]
    static constexpr double kUnseen = 0.6;
};

// Whether the right view has moved sideways: disparities and lengths change, and the left image
// does not.
struct BaselineDrift {
    // logarithm per frame | by which disparities and lengths change alike: 1.6 px where disparities
    //   are 40 px | at most 0.015 in rendered sequences without a drift, 0.028 in 60 frames of a
    //   beating heart at 80 px of disparity
    static constexpr double kMinJump = 0.04;
    // share of that change | by which the left image's scale may change besides: tissue that is
    //   stretched changes the scale and no disparity | 0.8 and more in the false alarms of [jumps]
    static constexpr double kMaxScaleShare = 0.5;
    // times the motion | of the frame before or of this one, whichever is slower: an image whose
    //   motion changes by more has jumped | at most 1.7 in rendered sequences without a jump, 2.6
    //   in a beating heart, [jumps]
    static constexpr double kJump = 3;
    // widths of the image | a slower motion counts as this one | 1 px of 480
    static constexpr double kLeastMotion = 0.002;
    // frames | after a jump, which are not measured: the surface is led to its place | one in
    //   `stretch`, [jumps]
    static constexpr int kSettling = 3;
    // frames | between two that are compared, at most | tissue changes in more of them
    static constexpr int kOldest = 10;
    // share of the drift | that lengths or disparities must show against the template's: else the
    //   frame does not confirm it | set by hand
    static constexpr double kConfirmingShare = 0.5;
    // frames | that do not confirm a drift, less those that do: there was none | less than a second
    static constexpr int kFramesToConfirm = 24;
    // vertices | that are measured, at most | set by hand
    static constexpr size_t kMaxVertices = 500;
    // vertices | and pairs that must be observed in both frames | set by hand
    static constexpr size_t kMinVertices = 50;
    // vertices | in their order, from one of a pair to the other | set by hand
    static constexpr size_t kPairStep = 6;
};

// Whether both views were zoomed.
// Source: [zoom]
struct Zoom {
    // logarithm | of the change of scale from one frame to the next, at least | `approach` has
    //   0.023 in each frame
    static constexpr double kLeast = 0.035;
    // logarithm per frame | by which the scale changes likewise before it and after it: the camera
    //   moves, and frames are missing | at most 0.015 in a beating heart, mostly not on both sides
    static constexpr double kNears = 0.008;
    // share of that change | by which, beyond the frame before, the picture may turn and move
    //   aside, lengths may change, and disparities may change otherwise than the scale
    static constexpr double kPure = 0.5;
};

}  // namespace defrec::decisions
