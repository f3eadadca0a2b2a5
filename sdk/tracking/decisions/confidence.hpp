// The numbers by which the tracker decides how sure a vertex is, and how large its expected error,
// as scripts/decisions/header.py reads them: unit | what it decides | source.
#pragma once
#include <cstdint>

namespace defrec::decisions {

struct Confidence {
    // 1/4096 | ZNCC of a check that fits, at least | tissue that slid by a millimetre has a median
    //   of 0 to 0.15, tissue in its place one above 0.9
    static constexpr int32_t kMinZncc = 2048;
    // 1/4096 per px^2 | by which it must be higher where the check was found away from where the
    //   surface has it, px of its level | 0.03: of points called tracked in `invivo1` 1.5 % agree
    //   by less than 0.5 with the template, 2.1 % without, [in-vivo-evidence]
    static constexpr float kZnccPerPx2 = 123;
    // 1/4096 | ZNCC of a check that is not located and fits where the surface has it, at least |
    //   0.8: `invivo1`, [in-vivo-evidence]
    static constexpr int32_t kMinZnccKept = 3277;
    // 1 | squared distance of its peak, of the squared radius in which it was searched | set by
    //   hand: as likely anywhere within
    static constexpr float kKeptShare = 0.5f;
    // share of the checks round a vertex | that must fit: some fit elsewhere by chance | points
    //   called observed beyond 2 mm fell from 7 to 0 in `motion-blur`, from 1 to 0 in `late-view`
    //   and `grasp`
    static constexpr float kMinFittingShare = 0.6f;
    // control points | to each side of one, whose checks are its region | the area of a lifted flap
    static constexpr int kRegionReach = 5;
    // share of the checks in the region | from there on the ZNCC above is enough | of points called
    //   observed on the bed of `rendered_g`'s flap half had less than 0.28, of others 1 % less than
    //   0.48, [contradicted]
    static constexpr float kFittingRegion = 0.6f;
    // share of the checks in the region | up to there a check must fit best: where most do not, the
    //   others fit by chance | [contradicted]
    static constexpr float kContradictedRegion = 0.35f;
    // 1/4096 | ZNCC of a check that fits there; in between it is interpolated | chance reached 0.92
    //   at the 95th percentile, [contradicted]
    static constexpr int32_t kMinZnccAlone = 3973;
    // of the smaller stretch | is the larger one, at most: a surface that is drawn out by more lies
    //   between sides that slide, and a check beside a vertex says nothing of it | [beside-lines]
    static constexpr float kMaxShear = 1.8f;
    // of the smaller stretch | is the larger one, from there on: a vertex without photometric
    //   evidence may move with neither of the sides round it | [weak-checks]
    static constexpr float kMayShear = 1.5f;
    // spacings of control points | along rows and columns of the grid, round a vertex that is
    //   sheared: a check there tells where its tissue is only if it was located, and beyond
    //   `max_shear` only with the least information | [weak-checks]
    static constexpr float kShearReach = 1.5f;
    // 1 / (0.1 px)^2 | information on a check's place in its worst direction, at least, beside
    //   sides that slide | [weak-checks]
    static constexpr float kMinInformation = 0.5f;
    // share of the checks in the region | where fewer are located one that is must have as much
    //   information, too | most fail there, [weak-checks]
    static constexpr float kMostFail = 0.5f;
    // spacings of control points | standard deviation of the place of a cut | [beside-lines]
    static constexpr float kLineSigma = 0.33f;
    // spacings of control points | from a cut: a vertex may be on its other side where checks are
    //   not found | [doubted-sides]
    static constexpr double kSideReach = 2;
    // frames | without photometric evidence where there was to be some, less those with it, from
    //   which on that is so | with 3 a frame that confirms it by chance is trusted, [doubted-sides]
    static constexpr uint8_t kSideDoubted = 2;
    // mm | expected error, at most, from the side of a cut that a vertex may be on: with more it is
    //   not observed | set by hand
    static constexpr float kMaxCutSide = 1;
    // mm | in depth between a vertex and one of another piece beside it: a point there may be on
    //   either piece, and is not observed | [refuted-checks]
    static constexpr float kMaxBorder = 2;
    // share of the checks round a vertex | as many are refuted by chance | [refuted-checks]
    static constexpr float kRefutedByChance = 0.2f;
    // px | a patch farther off counts as one at this distance | set by hand
    static constexpr float kFarthestPatch = 8;
    // mm | depth that the rig makes more uncertain is no evidence | set by hand
    static constexpr float kMaxRigDoubt = 0.5f;
    // mm | likewise where the right view is late | observed points beyond 1 mm fell from 2 to 0 in
    //   `sideways` at 0.1 mm a frame, [late-along-rows]
    static constexpr float kMaxLateDoubt = 0.3f;
    // mm | extrapolation reaches no farther from evidence, nor from the surface | set by hand
    static constexpr float kFarthest = 40;
    // mm | the error grows no farther with the distance from evidence | set by hand
    static constexpr float kFarthestGrowth = 20;
    // steps of the grid | from another piece within which a vertex without evidence is unknown |
    //   rendered steps of 4 to 10 mm
    static constexpr int kBesidePiece = 3;
    // steps of the grid | within which tissue that joined is one stretch, for distances from
    //   evidence | set by hand
    static constexpr int kJoinedReach = 3;
    // mm | root mean square error of an unknown vertex | with growth to its end; set by hand
    static constexpr float kErrorUnknown = 3.3f;
    // mm per frame | by which it grows while the vertex is unknown | set by hand
    static constexpr float kGrowthLost = 0.5f;
    // frames | after which it grows no more | set by hand
    static constexpr uint32_t kLongestGrowth = 100;
    // mm per mm | growth of the error of a point off the surface, beyond two steps of the grid |
    //   set by hand
    static constexpr double kGrowthOffSurface = 0.03;
    // mm | nothing is known of a point farther from the surface; its error is as large | set by
    // hand
    static constexpr double kFarthestOffSurface = 100;
    // mm | to the camera: nearer rays have no direction any more | set by hand
    static constexpr double kNearestToCamera = 1;
};

// The variance of a vertex's error is a sum of what each kind of evidence leaves open, each times a
// share: across the ray, both directions together, a1 to a4; along it b1 to b8.
// Source: least squares without negative shares over the rendered sequences that
//   `scripts/measure_calibration.sh` marks as fitted, then rounded and changed by up to 40 %,
//   [expected-error]
// Judged again by: scripts/measure_calibration.sh --backend cpu
struct ExpectedError {
    // 1 | a1: the squared distance of patches, at the vertex's depth
    static constexpr float kPatchShare = 0.46f;
    // 1 | a2: the squared distance at which the check fits best
    static constexpr float kCheckShare = 0.38f;
    // px^2 | a3: 1 - ZNCC there
    static constexpr float kMismatchShare = 0.14f;
    // 1 | a4: the squared distance from the nearest photometric evidence
    static constexpr float kFarPhotometric = 0.047f;
    // mm^2 | a5: the squared share of checks that are refuted | extrapolated points of `shear`,
    //   `shear3`, `resting` and `retraction`, [refuted-checks]
    static constexpr float kRefutedShare = 14;
    // px^2 | b1: disparity by itself
    static constexpr float kDisparityShare = 0.0009f;
    // 1 | b2: the squared distance of patches | doubled after the fit
    static constexpr float kDisparityPatchShare = 0.032f;
    // 1 | b3: the squared motion down the image during the lag; along the rows it is all an error
    static constexpr float kLateShare = 0.5f;
    // 1 | b4: the squared distance of the rows
    static constexpr float kRowShare = 0.155f;
    // 1 | b5: the squared distance from the nearest observed vertex
    static constexpr float kFarObserved = 0.031f;
    // 1 | b6: the squared distance over which the template was extrapolated
    static constexpr float kSupportShare = 0.014f;
    // 1 | b7: the squared depth residual
    static constexpr float kResidualShare = 0.028f;
    // 1 | b8: the squared mean depth residual of the frame
    static constexpr float kNoiseShare = 0.033f;
    // 1 | b9: the squared step to another piece beside the vertex | `loops`, [refuted-checks]
    static constexpr float kBorderShare = 0.12f;
    // px^2 | noise that neighbouring matches share without compression; a6 and b10 are of what is
    //   beyond it | at most 0.06 in rendered scenes, [shared-noise]
    static constexpr float kUsualSharedNoise = 0.05f;
    // 1 | a6: of it, across | `compressed`, [shared-noise]
    static constexpr float kSharedNoiseAcross = 1.3f;
    // 1 | b10: of it, of disparity | `compressed`, [shared-noise]
    static constexpr float kSharedNoiseAlong = 0.5f;
    // standard deviations | of the vergence, which are no vergence | set by hand
    static constexpr double kVergenceNoise = 2;
    // px^2 | in place of b3 and b4 without the right view | late frames of `late-view` and
    //   `rendered_d`
    static constexpr float kOneView = 1.7f;
    // px^2 | besides, where rows are of two times | `heartbeat` and `indentation`, [interlaced]
    static constexpr float kInterlaced = 0.6f;
    // px^2 | besides, where views converge: the squared angle between them, of which one view
    //   foreshortens what the other shows | fitted to `toe-in` at 12 and 20 degrees, [microscopes]
    static constexpr float kConvergence = 0.42f;
};

// How fast disparities change, by which expected errors grow while none is measured: without the
// right view, or while its lag spoils them.
struct DepthSpeed {
    // frames | over which a vertex's speed is a mean | set by hand
    static constexpr float kMemory = 8;
    // 1 | of the speed over all vertices that is left a frame later, unless it is that again:
    //   tissue that turns back is still there, but moves on | set by hand
    static constexpr float kDecay = 0.983f;
    // frames | after which errors grow no more: what moves comes back | set by hand
    static constexpr int kMostFrames = 30;
    // 1 | of the squared way at that speed | `respiration`, `body-pull`, `heartbeat` with 20 black
    //   right views, [one-view]
    static constexpr float kShare = 1.3f;
};

// Depth that the frames before contradicted.
struct ContradictedDepth {
    // frames | time constant of what depth is off by, in frames that contradict | noise of depth
    //   contradicts in single frames, [contradicted-depth]
    static constexpr float kRise = 8;
    // frames | the same in frames that agree | longer: beside a crease half of them agree by chance
    static constexpr float kFall = 40;
    // mm | a contradiction counts for so much at most: an instrument's edge over a check that still
    //   fits is no crease | set by hand
    static constexpr float kMost = 5;
    // mm | a vertex whose depth is off by so much is not called observed | points called observed
    //   beyond 2 mm in `loops` of seeds 31 and 32 and with climb 25: 51, 15, 60 without, 7, 15, 10
    //   with, [contradicted-depth]
    static constexpr float kMaxObserved = 0.5f;
    // 1 | or by so much of the frame's mean depth residual, if that is more | else `smoke` loses 1
    //   to 13 % of the points called tracked, `fat` 8 to 31 %
    static constexpr float kObservedShare = 3;
};

}  // namespace defrec::decisions
