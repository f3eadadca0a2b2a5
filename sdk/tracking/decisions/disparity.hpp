// The numbers by which the tracker decides which disparities are searched, which are left out and
// which given ones are wrong, as scripts/decisions/header.py reads them: unit | what it decides |
// source.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec::decisions {

// The disparities that stereo searches where the application does not say.
struct SearchRange {
    // px | both ends are multiples | set by hand
    static constexpr uint32_t kStep = 16;
    // px | fewer disparities are never searched | set by hand
    static constexpr uint32_t kMinDisparities = 48;
    // px | no more are searched before there is a template, unless the coarse search saw more | set
    //   by hand
    static constexpr uint32_t kMaxDisparities = 256;
    // px | no more are searched at once; a multiple of the step | the range of `disparities`
    static constexpr uint32_t kMostDisparities = 496;
    // px | no range begins beyond | the range of `min_disparity`
    static constexpr uint32_t kMaxBegin = 1024;
    // px | nor ends | the sum of both
    static constexpr uint32_t kEnd = kMaxBegin + kMostDisparities;
    // share of the width | disparities are no larger before there is a template | set by hand
    static constexpr double kMaxShare = 0.45;
    // share of the template's smallest disparity | the near end of the range: tissue may go
    //   farther by half | set by hand
    static constexpr double kBelow = 0.55;
    // share of the template's largest disparity | the far end of the range: tissue may come
    //   nearer by half | set by hand
    static constexpr double kAbove = 1.6;
    // px | more at the far end | set by hand
    static constexpr int kMargin = 4;
    // share of the width | at least so much farther and nearer where views converge, whose
    //   disparities are counted from their offset | half of an endoscope's disparity
    static constexpr double kReach = 0.03;
    // px | about the disparities of the coarse search | two of its steps for the outermost tissue
    static constexpr int kSeenMargin = 32;
    // times `min_coverage` | exchanged views with more depth than that may be called swapped | set
    //   by hand
    static constexpr double kSwappedCoverage = 2;
    // times the depth of the views as given | and with more than that | set by hand
    static constexpr double kSwappedFactor = 3;
};

// A mask of pixels to ignore, where its frame gives no template.
struct IgnoreMask {
    // share of the pixels with depth | ignored, where there is enough depth without the mask: the
    //   mask is refused | inverted masks hide 0.89 or more, [compressed]
    static constexpr double kMinHidden = 0.5;
};

// The search for the disparities of a pair of views, before stereo searches.
struct CoarseSearch {
    // px | the images are at least so wide; halved while they are | set by hand
    static constexpr uint32_t kMinWidth = 160;
    // px | of a small image, about the middle of a window | 9 x 9, as stage stereo
    static constexpr int kRadius = 4;
    // gray levels | standard deviation in a window, at least | three times the noise of a mean
    static constexpr float kMinDeviation = 1.5f;
    // ZNCC | at least | set by hand
    static constexpr float kMinScore = 0.7f;
    // ZNCC | above every other but the neighbours | set by hand
    static constexpr float kMinLead = 0.05f;
    // share of the windows | fewer matches say nothing | a share that chance does not give
    static constexpr double kMinShare = 0.05;
    // share of the matches | left out at either end | highlights and chance matches
    static constexpr double kOutermost = 0.02;
};

// Disparity that the application gives: what it may hold, and when it is not that of the images.
struct GivenDisparity {
    // px | the largest one | int16 in 1/16 px
    static constexpr float kMax = 2000;
    // px | the least standard deviation that may be stated | a fiftieth of the rounding
    static constexpr float kMinSigma = 0.001f;
    // px | round a patch, of which the mean is compared: noise of single pixels averages out | set
    //   by hand
    static constexpr int64_t kRadius = 2;
    // patches | with disparity and found in the left view; where there are fewer, nothing disagrees
    //   | set by hand
    static constexpr size_t kMinPatches = 24;
    // share of these | that the right view must show near where the surface has them | set by hand
    static constexpr double kMinFound = 0.3;
    // px | median of the differences; a smaller one is none | set by hand
    static constexpr double kMinError = 0.75;
    // standard deviations as stated | likewise | set by hand
    static constexpr double kSigmas = 2;
    // standard deviations | in a median of absolute values | of a normal distribution
    static constexpr double kDeviation = 1.4826;
    // px | of a patch that is not found, and the largest one | how far they are searched
    static constexpr float kUnfoundError = 16;
};

}  // namespace defrec::decisions
