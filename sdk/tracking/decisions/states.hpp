// The numbers by which the tracker decides whether a frame, a template or a piece of the surface
// was found, as scripts/decisions/header.py reads them: unit | what it decides | source.
#pragma once
#include <cstddef>
#include <cstdint>

#include "sdk/base/util/ratio.hpp"

namespace defrec::decisions {

// Other evidence is asked for after a frame that was found than after one that was lost.
template <class T>
struct ByState {
    T found, lost;
    constexpr T after(bool was_found) const { return was_found ? found : lost; }
};

// Whether the surface was found in a frame: after a frame that was found; after one that was lost.
struct FrameFound {
    // px | from where the deformed surface has a patch to where it was found: it is confirmed | set
    //   by hand
    static constexpr double kConfirmedDistance = 2;
    // patches | that must be confirmed | set by hand
    static constexpr ByState<uint32_t> kMinPatches = {30, 60};
    // share of the patches expected | that must be confirmed | a wrong surface confirms one in
    //   fifty by chance, a right one in heavy smoke one in ten
    static constexpr ByState<double> kMinPatchShare = {0.05, 0.12};
    // patches | enough in place of `min_patches` with `min_matches` | set by hand
    static constexpr uint32_t kMinPatchesWithMatches = 20;
    // matches | that must agree then | set by hand
    static constexpr uint32_t kMinMatches = 15;
    // share of the vertices in the image | with depth that agrees, where depth is used | 0.11 to
    //   0.17 agreed with a wrong surface where the views were two frames apart, 0.45 and more with
    //   the right one in the first frame after a loss, [found-by-chance]
    static constexpr ByState<double> kMinDepthShare = {0.1, 0.25};
    // share of the first view's vertices | that must lie in the image | set by hand
    static constexpr double kMinInsideShare = 0.05;
    // of the landmarks | an image with as many features and `few_matches` shows other tissue, whose
    //   patches agree by chance | set by hand
    static constexpr Ratio kOtherTissueFeatures = {1, 2};
    // of all features that are looked for | where the template's texture is faint a frame with as
    //   many shows more than noise
    //   | 16 to 207 of 768 are noise, [faint-texture]
    static constexpr Ratio kMoreThanNoise = {1, 2};
    // matches | fewer agree: other tissue, or `DEFREC_REASON_FEW_MATCHES` | set by hand
    static constexpr uint32_t kFewMatches = 10;
    // share of the patches expected | fewer confirmed: other tissue | where texture and depth are
    //   alike, more patches agree by chance
    static constexpr double kOtherTissueShare = 0.12;
};

// Whether a template that the tracker captured by itself stands.
// Source: first frames blurred by sigma 3 to 25 px, [sound-start]
struct TemplateTrial {
    // share of the vertices | that the template's own frame must show again, in depth and in the
    //   image: less cannot be followed | 0.24 and more in sharp frames, 0.46 at sigma 3, 0.06 at 6
    static constexpr double kMinShown = 0.1;
    // patches | confirmed in that frame for each vertex: so many do instead where texture is too
    //   faint for checks | 0.035 at a contrast of 0.045, at most 0.011 at sigma 6 px
    static constexpr double kMinPatches = 0.02;
    // px RMS | that they may lie off where the template has them | at most 0.08 where the image is
    //   sharp, also where it is faint; 0.28 to 0.45 from sigma 6 px on
    static constexpr double kMaxPatchRms = 0.15;
    // features | of a frame by which a template is judged, at least
    static constexpr uint32_t kMinFeatures = 60;
    // of the features of the template's own frame | a frame with as many shows more of the tissue;
    //   where it is lost, it counts against the template | 2.9 and more at sigma 3
    static constexpr double kRicher = 2;
    // of the features of the template's own frame | a lost frame with as many counts while no
    //   frame has found the template
    static constexpr double kAsRich = 0.5;
    // frames | that count, since the last that found the template: it is given up | a jolt of the
    //   camera may lose two
    static constexpr uint32_t kLostFrames = 3;
    // frames | that show more and find the template all the same: it is judged no longer
    static constexpr uint32_t kFoundFrames = 10;
};

// Whether a frame is registered once more, with patches searched farther away.
struct WideSearch {
    // share of the patches expected | fewer confirmed: a wide search is due,
    //   `DEFREC_REASON_LOW_CONTRAST`, a piece is degraded | set by hand, [wide-search]
    static constexpr double kFewConfirmed = 0.45;
    // occasions | the longest pause after wide searches that found no more | set by hand,
    //   [wide-search]
    static constexpr uint32_t kLongestPause = 8;
};

// Whether a piece of the surface was found: after a frame in which it was found; after one in which
// it was lost.
struct Pieces {
    // patches | that must be confirmed | set by hand, [pieces]
    static constexpr ByState<uint32_t> kMinPatches = {5, 10};
    // share of the piece's patches expected | that must be confirmed | a wrong place confirms one
    //   in fifty by chance
    static constexpr ByState<double> kMinPatchShare = {0.05, 0.12};
    // share of the piece's vertices in the image | with depth that agrees, where depth is used | as
    //   of a frame
    static constexpr ByState<double> kMinDepthShare = {0.1, 0.25};
    // share of the piece's vertices | in the image: the piece is expected there | set by hand
    static constexpr Ratio kExpectedShare = {1, 20};
};

// A piece that is lost is looked for by RANSAC over the matches of its landmarks.
struct PieceSearch {
    // mm | within which matches agree on a rigid motion | tissue that bends is rigid to that much
    static constexpr double kTolerance = 3;
    // matches | that must agree | set by hand
    static constexpr size_t kMinMatches = 12;
    // share of the piece's matches with depth | that must agree | set by hand
    static constexpr double kMinShare = 0.15;
    // mm | between the three matches that fix a motion | set by hand
    static constexpr double kCornersApart = 4;
    // share | by which the distance of two of them may change, besides half the tolerance | set by
    //   hand
    static constexpr double kStretch = 0.1;
    // triples | that are drawn at most | set by hand
    static constexpr int kAttempts = 2000;
    // motions | that are tried at most | set by hand
    static constexpr int kMotions = 200;
    // mm | standard deviation of the Gaussian by which matches round a control point count | set by
    //   hand
    static constexpr double kFitReach = 8;
    // weight | of all other matches | set by hand
    static constexpr double kFitElsewhere = 0.02;
};

}  // namespace defrec::decisions
