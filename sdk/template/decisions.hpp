// The numbers by which a template is made, grows and moves points, as scripts/decisions/header.py
// reads them: unit | what it decides | source.
#pragma once
#include <cstddef>
#include <cstdint>

#include "sdk/base/util/ratio.hpp"

namespace defrec::decisions {

// ---- the surface --------------------------------------------------------------------------------

// The disparity at a vertex, or a pixel: a plane fitted to what was measured round it.
struct PlaneFit {
    // steps of the grid | half the side of a vertex's window | set by hand
    static constexpr double kRadius = 0.75;
    // px | and at least | set by hand
    static constexpr int kMinRadius = 3;
    // fits | each without the outliers of the one before | set by hand
    static constexpr int kFits = 3;
    // px | residual of an outlier of the first fit | set by hand
    static constexpr double kFirstOutlier = 2;
    // standard deviations | residual of an outlier of a later fit | set by hand
    static constexpr double kOutlier = 2.5;
    // px | and at least | set by hand
    static constexpr double kMinOutlier = 0.5;
    // px | pixels that a fit needs | set by hand
    static constexpr int kMinPixels = 12;
    // share of the window | pixels that a fit needs as well | else it would extrapolate a few at
    //   the rim
    static constexpr double kMinFit = 0.15;
    // px | a smaller disparity is none | set by hand
    static constexpr double kMinDisparity = 0.5;
};

// The smooth surface through the fits.
struct TemplateSurface {
    // share of the vertices | with measured depth; less is no template, and the frame has
    //   `DEFREC_REASON_NO_DEPTH` | set by hand
    static constexpr double kMinCoverage = 0.15;
    // tangent (56 degrees) | a steeper plane fit is left out | it is the blurred edge of something
    //   in front
    static constexpr double kSteepest = 1.5;
    // medians of the slopes | limit where half of the tissue is nearly as steep | it is far away,
    //   and noise is steep
    static constexpr double kSteepestOfMedian = 1.6;
    // steps of the grid | so near a rejected surface fits are left out | their windows saw both
    static constexpr int kRejectedMargin = 2;
    // 1 | of the splines: they smooth below about 16 steps of the grid | rendered sequences,
    //   [smoother-template]
    static constexpr double kStiffness = 100;
    // px per squared step of the grid | a surface that bends by so much is half as stiff |
    //   [smoother-template]
    static constexpr double kBend = 0.015;
    // 1 | how fast the second falls to 0 where nothing was measured | the slope of the last cells
    //   says little of what lies many cells beyond
    static constexpr double kPull = 4;
    // share of the image's width | so far the surface goes on beyond measured depth | set by hand
    static constexpr double kReach = 0.12;
    // of the smallest measured disparity | beyond it the surface has no smaller one | set by hand
    static constexpr double kMinDisparity = 0.8;
    // of the largest measured disparity | nor a larger one | set by hand
    static constexpr double kMaxDisparity = 1.25;
    // px | the largest standard deviation of disparity that an application may state | set by hand
    static constexpr float kMaxSigma = 100;
};

// The pieces of the surface.
struct TemplatePieces {
    // share of the disparity | by more, a surface is a step away from another and does not continue
    //   it | 3 mm at 80 mm
    static constexpr double kStep = 0.04;
    // steps of the grid | from the samples, a continuation is compared with another surface | set
    //   by hand
    static constexpr float kNearSteps = 8;
    // samples | fewer near ones: the other surface is judged as a whole | set by hand
    static constexpr size_t kMinNear = 12;
    // share of the disparity | a surface that is not near may lie so far behind and belong to the
    //   tissue | tissue beyond an instrument
    static constexpr double kBehind = 0.15;
    // samples | smaller sets do not continue a piece | set by hand
    static constexpr int kMinSet = 3;
    // rounds | in which sets join a piece, at most | set by hand
    static constexpr int kMaxRounds = 3;
    // share of the samples | smaller surfaces do not end a piece | they may be wrong
    static constexpr Ratio kMinOtherShare = {1, 50};
    // share of the samples | smaller surfaces are no piece of their own | set by hand
    static constexpr double kMinPieceShare = 0.01;
    // mm | a surface in front in which such a disc fits is tissue | no instrument is as wide
    static constexpr double kTissueRadius = 10;
    // pieces | of a surface, at most | set by hand
    static constexpr size_t kMaxPieces = 8;
};

// ---- what moves it, and what is found again -----------------------------------------------------

// A template of less is none.
struct TemplateSize {
    // control points | of a template, at least | set by hand
    static constexpr size_t kMinNodes = 4;
    // vertices | of a template, at least | set by hand
    static constexpr size_t kMinVertices = 16;
};

// Which control points are connected, and how firmly.
struct Connections {
    // control points | connected with each, the nearest ones | [solver-needs]
    static constexpr size_t kNeighbours = 8;
    // spacings of control points | no connection is longer | set by hand
    static constexpr double kFarthestEdge = 2.5;
    // spacings of control points | standard deviation of the Gaussian that weights connections |
    //   set by hand
    static constexpr double kEdgeReach = 1.5;
};

// The control points that move a point.
struct PointWeights {
    // share | of the bilinear weights at a pixel that a piece's vertices must have: it lies there |
    //   half
    static constexpr double kMinPieceWeight = 0.5;
    // cells | from a pixel whose control points all lie beyond a cut, within which another one
    //   moves it | set by hand
    static constexpr int kCutReach = 2;
    // spacings of control points | from a pixel of tissue that joined, within which control points
    //   may move it | set by hand
    static constexpr double kReach = 3;
    // control points | the nearest of these, among which are the corners of the Delaunay triangle
    //   round the pixel | set by hand
    static constexpr size_t kNearest = 12;
    // squared spacings | twice the area of such a triangle, at least | set by hand
    static constexpr double kMinArea = 1e-3;
    // squared sine | of the angle at a corner; where it is smaller, weights of a patch are taken
    //   not to change | set by hand
    static constexpr double kThin = 1e-3;
};

// The control points with which a place beside the surface moves as a rigid body.
struct Anchors {
    // control points | whose rigid motion a new control point, or a point beside the surface,
    //   follows | set by hand
    static constexpr size_t kAnchors = 12;
    // spacings of control points | standard deviation of the Gaussian that weights them | set by
    //   hand
    static constexpr double kAnchorReach = 2;
};

// How fine the texture is that stands out from the noise.
// Source: the rendered scenes and recordings of [faint-texture]
struct TextureLevel {
    // 1 | standard deviation of a normal distribution over the median of its magnitude | 1.4826
    static constexpr double kMedianToSigma = 1.4826;
    // 1 | noise of a second difference across and down over that of a pixel | the root of the
    //   weights' squares
    static constexpr double kDifference = 6;
    // px of the level | half the side of a window | that of a patch
    static constexpr int kWindowRadius = 5;
    // gray levels | no sensor has as much noise: what is as rough is texture, such as random dots |
    //   0.3 to 1.5 in recordings and rendered scenes
    static constexpr double kMostNoise = 5;
    // ZNCC | that is expected of a window, at least | patches need 0.7, and have more where the
    //   surface turned and what they show is smooth
    static constexpr double kMinZncc = 0.6;
    // share of the windows | that have it: the level is fine enough | 0 to 0.26 in `fat`, 0.35 and
    //   more in textured scenes on level 0, 0.9 and more on level 1
    static constexpr double kMinShare = 0.33;
    // windows | that tell something, at least | set by hand
    static constexpr size_t kFewestWindows = 24;
    // gray level | a window whose mean is less is beside the endoscope's picture | set by hand
    static constexpr double kDark = 20;
    // gray level | a window with a pixel of that is a highlight | as of images
    static constexpr double kSaturatedFrom = 250;
    // level | no patch is searched on a coarser one for its texture | windows of 88 px show less
    //   of what deforms
    static constexpr uint32_t kMaxLevel = 2;
    // level | from here on a template is faint | larger windows of stage stereo raise the p95 of
    //   `smoke`, which has 1, from 0.69 to 0.74 mm
    static constexpr uint32_t kFaint = 2;
};

// The places of patches.
struct PatchPlaces {
    // px | cells of patches are no smaller; else their area is that of the image / `max_patches` |
    //   set by hand
    static constexpr double kMinPatchCell = 12;
    // px | between the pixels of a cell that are tried, and between those of the mask | set by hand
    static constexpr int kPixelStep = 2;
    // px | half the side of the window whose texture counts | set by hand
    static constexpr int kWindowRadius = 4;
    // gray levels^2 | smaller eigenvalue of the structure tensor, per pixel; less is no patch | set
    //   by hand
    static constexpr double kMinTrackability = 0.15;
    // px of the texture level | no patch lies so near a masked pixel | set by hand
    static constexpr int kMaskReach = 5;
    // px of the texture level | nor so near the rim of the first view | set by hand
    static constexpr int kBorder = 8;
    // px | nor so near the rim of a later one | an atlas image has other tissue beyond it
    static constexpr int kPageBorder = 20;
};

// Check patches.
struct CheckPatches {
    // px of width | from here on checks and wide searches use images half as large, or those of the
    //   texture level | set by hand
    static constexpr uint32_t kLargeImage = 640;
    // px of the level | half the side of a check patch | set by hand
    static constexpr uint32_t kCheckRadius = 7;
    // px of the level | a check finds its patch within this; one less in large images | set by hand
    static constexpr uint32_t kCheckSearchRadius = 4;
    // gray levels^2 | smaller eigenvalue of the structure tensor, per pixel; less is no check patch
    //   | noise of a sensor alone has less
    static constexpr double kMinCheckTexture = 0.5;
};

// ---- growth -------------------------------------------------------------------------------------

// Tissue that joins.
struct JoiningTissue {
    // px of a keyframe | for a px of the first view, at least | set by hand
    static constexpr double kMinScale = 0.5;
    // px of a keyframe | and at most | set by hand
    static constexpr double kMaxScale = 4;
    // px | the spacing of the grid over a keyframe is no smaller | as `min_vertex_spacing` of grids
    static constexpr double kMinSpacing = 4;
    // mm | nearer to the camera the tracked surface is left out | set by hand
    static constexpr double kMinDepth = 1;
    // mm | median distance of the surface from live depth, at most | set by hand
    static constexpr double kMaxMisfit = 1;
    // share of the image | with surface that was found; less does not fix the view | set by hand
    static constexpr double kMinOverlap = 0.15;
    // share of the depth | by which two keyframes may disagree | set by hand
    static constexpr double kSameDepth = 0.02;
    // px | round where the tissue was in the earlier keyframe, within which that must have its
    //   depth | set by hand
    static constexpr int kSeenReach = 2;
    // steps of the grid | from the tracked surface's vertices to a new one, at least | set by hand
    static constexpr double kNewVertexApart = 0.5;
    // vertices | of a part that joins, and of a surface that continues a piece | set by hand
    static constexpr size_t kMinNew = 12;
    // vertices | of a hole that is filled | a highlight
    static constexpr size_t kMaxHole = 60;
    // steps of the grid | to a vertex of the tracked surface that a part touches, and that its
    //   triangles end at | set by hand
    static constexpr double kTouch = 1.5;
    // squared steps of the grid | twice the area of a triangle, at least | set by hand
    static constexpr double kMinTriangle = 0.02;
    // spacings of control points | a control point is added where no other is nearer | set by hand
    static constexpr double kNewNodeApart = 0.65;
    // spacings of control points | and a new cell is no farther | set by hand
    static constexpr double kNewNodeReach = 1.5;
    // sides of a check patch | from what is new, within which checks are added to tissue that had
    //   none | set by hand
    static constexpr int kCheckReach = 2;
    // steps of the grid | round what is new that are kept of the grid over the keyframe | set by
    //   hand
    static constexpr int kGridMargin = 4;
};

// The images of later views, of which parts lie in the atlas.
struct AtlasLimits {
    // images | first view and atlas | what stage align takes
    static constexpr size_t kMaxViews = 64;
    // px | of the image that is kept round a patch | its search may sample as much
    static constexpr double kPatchReach = 48;
    // of the area of the patches' cells | a part of the image that is larger is halved | set by
    //   hand
    static constexpr double kMaxUnfilled = 2;
    // `patch_reach` | where it is longer than this | set by hand
    static constexpr double kMinHalved = 4;
};

}  // namespace defrec::decisions
