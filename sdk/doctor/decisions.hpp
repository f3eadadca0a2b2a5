// The numbers by which the doctor decides, as scripts/decisions/header.py reads them: unit | what
// it decides | source. [name] is a page of docs/experiments.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace defrec::decisions {

// How much of a recording the doctor looks at.
struct DoctorSample {
    // px | in all frames that are tracked | 10 s on two cores of a processor of 2020
    static constexpr double kTrackedPixels = 12e6;
    // frames | that are tracked, at least | a lag and an estimate of the rig take as many
    static constexpr std::int64_t kMinFrames = 12;
    // frames | that are tracked, at most | 1 to 2 s of video
    static constexpr std::int64_t kMaxFrames = 40;
    // lit frames | without a template, after which no more are tracked: each takes long | set by
    // hand
    static constexpr int kMostWaiting = 4;
    // frames | whose views are matched, spread over those that are tracked | set by hand
    static constexpr int kMatchedFrames = 5;
    // rows | of a disparity image, of which one is counted | a quarter of the pixels says as much
    static constexpr int kDisparityRows = 4;
};

// How the two views are matched, without a calibration: corners of the left view by ZNCC in the
// right one, from coarse to fine.
struct DoctorMatches {
    // px | width of the coarse image, in which patches are searched everywhere | set by hand
    static constexpr int kCoarseWidth = 240;
    // px | width of the middle image, or of the frames if that is less | set by hand
    static constexpr int kMiddleWidth = 640;
    // px | half of the side of a patch | set by hand
    static constexpr int kHalfPatch = 7;
    // corners | of the left view, at most | set by hand
    static constexpr int kMaxCorners = 160;
    // share of the strongest corner | the score of the weakest one | set by hand
    static constexpr double kCornerQuality = 0.003;
    // share of the width | between corners | set by hand
    static constexpr double kCornerDistance = 0.02;
    // share of the height | by which the rows of a corner may differ | the raw views of the public
    //   data sets differ by 0.03 at most
    static constexpr double kMaxRowShare = 0.12;
    // px | farther from the place that the level before gave is not searched | set by hand
    static constexpr int kRefine = 5;
    // 1 | ZNCC of a match, at least | set by hand
    static constexpr double kMinScore = 0.8;
    // 1 | by which the ZNCC elsewhere is less | set by hand
    static constexpr double kMinLead = 0.05;
    // px | of the coarse image: the corner is found again by the way back | set by hand
    static constexpr double kMaxReturn = 1.5;
    // gray levels | a patch with as bright a pixel shows a highlight or text | as stage rectify
    static constexpr double kHighlight = 250;
    // gray levels | a patch with as dark a pixel shows a border | set by hand
    static constexpr double kBorder = 6;
    // matches | that say something together, at least | views of two things have 0 to 2 in a frame
    static constexpr std::size_t kMinMatches = 15;
};

// Which way the calibration fits the images.
struct DoctorOrder {
    // share of the matches | in front of the cameras: the calibration may be right | mismatches
    static constexpr double kMinFront = 0.75;
    // share of the matches | in front of the cameras, at most, where they stand behind | mismatches
    static constexpr double kMaxFront = 0.25;
    // matches | of a pair of images: with fewer its rows do not count | set by hand
    static constexpr std::size_t kMinMatches = 8;
    // share of the matches | at either end of depths and disparities, that does not count |
    //   mismatches
    static constexpr double kOutliers = 0.05;
    // px | median by which rows differ, from which another calibration is tried | set by hand
    static constexpr double kMinRowError = 0.8;
    // share of that median | left by a calibration that is better | set by hand
    static constexpr double kBetter = 0.5;
};

// Lengths of stereo endoscopes, microscopes and exoscopes.
struct DoctorLengths {
    // mm | a shorter baseline is not plausible | endoscopes of the public data sets have 3.5 to 5.6
    static constexpr double kMinBaseline = 2;
    // mm | nor is a longer one | microscopes have 22 to 27, exoscopes up to 40
    static constexpr double kMaxBaseline = 60;
    // mm | tissue nearer than that is not plausible | endoscopes are focused from 20 on
    static constexpr double kMinDepth = 12;
    // mm | nor is tissue farther away | microscopes work from 200 to 625
    static constexpr double kMaxDepth = 700;
    // 1 | baseline over depth, at least | 0.04 to 0.3 of endoscopes, 0.04 to 0.12 of microscopes
    static constexpr double kMinRatio = 0.012;
    // 1 | and at most | likewise
    static constexpr double kMaxRatio = 0.45;
    // mm | of a metre, centimetre, inch, micrometre: units that are tried | what programs write
    static constexpr std::array<double, 4> kUnits = {1000, 10, 25.4, 0.001};
};

// The size for which a calibration was made.
struct DoctorSize {
    // 1 | by which the ratio of widths differs from that of heights: not scaled but cut | rounding
    static constexpr double kSameAspect = 0.01;
    // share of a side | from the image's middle, beyond which a principal point shows another size
    //   | as RigLimits, for both directions and both views
    static constexpr double kFarOff = 0.2;
};

// The limits that the images themselves must keep.
struct DoctorImages {
    // share of the frames | more with a reason of the library are a finding | one frame may be bad
    static constexpr double kReasonShare = 0.2;
    // gray levels | darker pixels are no tissue but a border | as DoctorMatches
    static constexpr double kBorder = 6;
    // gray levels | a pixel is saturated from here on | as Images
    static constexpr double kSaturated = 250;
    // share of the lit pixels | more saturated ones are a finding | set by hand, [doctor]
    static constexpr double kMaxSaturated = 0.2;
    // share of the lit pixels | whose darkest one says how bright a view is | set by hand
    static constexpr double kBrightShare = 0.1;
    // gray levels | such a pixel of a view that is too dark | set by hand
    static constexpr double kDark = 40;
    // share of the view | less of it lit is a finding | a round aperture in 16:9 has 0.44
    static constexpr double kMinLit = 0.2;
    // gray levels | a view with a lower mean is black | as Images
    static constexpr double kBlack = 6;
    // share of the pixels | a view with more saturated ones is white | as Images
    static constexpr double kWhite = 0.6;
    // share of the frames | in more of them a view is black or white: a problem, and the lit ones
    //   are too few | set by hand
    static constexpr double kMostBlank = 0.5;
    // ranges | of frames that are named | a line has room for them
    static constexpr std::size_t kNamedRanges = 4;
};

// Views that stand still.
struct DoctorRepeats {
    // rows | of an image, of which one is compared with the frame before | set by hand
    static constexpr int kRows = 8;
    // gray levels | a view that differs by less on average repeats the one before | 1.7 and more
    //   between frames of the public data sets
    static constexpr double kMaxDifference = 0.1;
    // frames | in a row that repeat both views, at least; a recorder of more frames than the camera
    //   gives repeats fewer | set by hand
    static constexpr std::size_t kMinRun = 3;
    // frames | in a row that repeat one view alone, at least; tissue may stand still for one, and a
    //   view be late | set by hand
    static constexpr std::size_t kMinRunOfOne = 2;
};

// Whether the surface is followed.
struct DoctorFollowed {
    // share of the lit frames | in more of them the surface is lost or has no template: a finding |
    //   as kReasonShare of the images
    static constexpr double kMaxMissed = 0.2;
    // share of the lit frames | more are a problem | set by hand
    static constexpr double kMostMissed = 0.5;
};

// Bars beside the picture, or above and below it.
struct DoctorBars {
    // gray levels | darker pixels are no tissue but a border | as DoctorMatches
    static constexpr double kBorder = 6;
    // share of the lines with a pixel that is no border | whose border ends at the same place, but
    //   for a pixel: a straight bar | a round aperture has 0.1
    static constexpr double kStraight = 0.9;
    // share of all lines | that have such a pixel, at least | set by hand
    static constexpr double kMinLines = 0.3;
    // share of the side | a narrower bar is an edge of the sensor or of a remap | set by hand
    static constexpr double kLeast = 0.02;
};

// How fine the detail of the images is, by the energy of octaves in blocks with texture.
struct DoctorDetail {
    // octaves | whose energies are compared, from the finest on | up to 16 px
    static constexpr std::size_t kOctaves = 4;
    // px | side of a block | twice the longest of these
    static constexpr int kBlock = 32;
    // gray levels | darker pixels are no tissue but a border | as DoctorMatches
    static constexpr double kBorder = 6;
    // gray levels | brighter ones are a highlight or text | as DoctorMatches
    static constexpr double kHighlight = 250;
    // px | wide; blocks with such a pixel so near do not count | set by hand
    static constexpr int kAside = 17;
    // gray levels squared | that rounding to whole ones leaves in the finest octave; a quarter of
    // it
    //   in each further one | 3/4 of 1/12
    static constexpr double kRounding = 0.0625;
    // gray levels squared | in all octaves of a block: less is no texture | twice a camera's noise
    static constexpr double kMinEnergy = 4;
    // px | width and height of the part in the middle that a run looks at, at most | 10 ms
    static constexpr int kMiddle = 1024;
    // blocks | fewer tell nothing | set by hand
    static constexpr std::size_t kMinBlocks = 10;
    // share of a block's energy | median of what is finer than 2 px, at least | 0.006 to 0.009 of
    //   magnified images, 0.020 to 0.28 of others, [soft-images]
    static constexpr double kMinBelow2 = 0.014;
    // share of a block's energy | median of what is finer than 4 px, at least | 0.02 of images
    //   that were magnified 4 times, 0.06 to 0.11 of 2 and 3 times, [soft-images]
    static constexpr double kMinBelow4 = 0.035;
};

// How the views fit each other.
struct DoctorViews {
    // px RMS | rows that disagree by more are a warning: frames are degraded | as RigRows
    static constexpr double kToldRowError = 0.4;
    // px RMS | and by more than this a problem: most of the surface has no depth | [row-errors]
    static constexpr double kMaxRowError = 0.6;
    // px | width of Tukey's kernel in the fit of rows, first to last | set by hand
    static constexpr std::array<double, 5> kTukeyWidths = {12, 6, 3, 1.5, 1.5};
    // share of the frames | with a lag of the right view: a finding | one or two may be misfits
    static constexpr double kLateShare = 0.12;
    // frames | median of their lags, at least | set by hand
    static constexpr double kMinLag = 0.25;
    // px | by which the steps of the rows differ from frame to frame, at least: no calibration does
    //   that | set by hand
    static constexpr double kMovingRows = 0.6;
    // share of the left view | that the right one sees, at least | 0.75 of in-vivo recordings
    static constexpr double kMinOverlap = 0.6;
    // share of the matches | outside of the disparities that are searched: a finding | a round
    //   aperture, round which stereo finds less than the matches, has more than 0.1
    static constexpr double kMaxOutside = 0.3;
    // px | beyond the last disparity that was found: outside | likewise
    static constexpr double kBeyond = 3;
    // gray levels | views that differ by less on average are one and the same | noise of a camera
    static constexpr double kSameView = 0.4;
};

// Whether other pairs of frames than those given are of one time.
struct DoctorPairings {
    // frames | by which the views are shifted against each other, at most | set by hand
    static constexpr int kMostFrames = 3;
    // frames | whose views are matched in each pairing, spread over those that are tracked | set by
    //   hand
    static constexpr std::size_t kMatchedFrames = 7;
    // matches | of a pair of images: with fewer its rows do not count | set by hand
    static constexpr std::size_t kMinMatches = 8;
    // px | median by which rows differ, from which pairings are tried | four times a camera's noise
    static constexpr double kMinRowMotion = 0.2;
    // share of what the pairs as they are have | of rows that differ otherwise than in all frames,
    //   at most: the pairing is the right one | set by hand
    static constexpr double kBetter = 0.5;
    // px | by which it is less, at least | set by hand
    static constexpr double kLess = 0.1;
    // px | by which rows of a frame may agree worse | set by hand
    static constexpr double kWorse = 0.15;
    // px | of rows that differ otherwise than in all frames: with more, views are not of one time |
    //   a lag that changes leaves 2
    static constexpr double kAgree = 0.5;
    // share of what each other pairing has | by which rows differ where the tracker finds a lag, at
    //   most: the pairing is the likely one | a lag of half a frame gives 1
    static constexpr double kClearlyBest = 0.7;
    // frames | by which a lag is off a whole number, at most: whole frames can be left out | set by
    //   hand
    static constexpr double kWhole = 0.3;
};

}  // namespace defrec::decisions
