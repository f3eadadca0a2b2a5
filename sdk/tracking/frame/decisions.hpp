// The numbers by which the tracker decides, one struct for each decision. Before each number stands
// a comment: unit | what it decides | source. A unit of 1 is none. The source is a formula, a
// measurement or the reasoning that fixed the number; [name] is a page of docs/experiments; "set by
// hand" says that none is recorded. A struct whose numbers share a source names it, as "Source:".
// scripts/decisions/generate.py writes the tables of docs/tracker/numbers_*.md from this file, and
// scripts/decisions/check.py finds numbers that stand elsewhere.
#pragma once
#include <array>
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

// Values for the solver's passes, and for the searches of patches before the last two.
template <class T>
struct ByPass {
    T coarse, middle, fine;
};
template <class T>
struct BySearch {
    T middle, fine;
};

// ---- before a frame -----------------------------------------------------------------------------

// The spacing of a template's grids where the application names none, and their limits.
struct Grids {
    // widths of the image | the inverse of the spacing of control points (an option) |
    //   `rendered_c`, [local-deformation]
    static constexpr float kNodesAcross = 32;
    // widths of the image | the inverse of the spacing of vertices (an option) | set by hand
    static constexpr float kVerticesAcross = 120;
    // px | the spacing of vertices is no smaller unless it is asked for | set by hand
    static constexpr float kMinVertexSpacing = 4;
    // vertices | a spacing that gives more is refused | templates of more take minutes and
    //   gigabytes
    static constexpr double kMaxVertices = 250000;
    // control points | likewise | templates of more take minutes and gigabytes
    static constexpr double kMaxNodes = 20000;
};

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

// ---- the stages ---------------------------------------------------------------------------------

// The solver's passes: coarse, middle, fine. A search of patches comes before the last two.
struct Passes {
    // level of the pyramid | the image in which patches are searched; one higher in a wide search
    //   of large images; the texture level where that is higher | set by hand
    static constexpr BySearch<uint32_t> kSearchLevel = {1, 0};
    // px of the level | how far patches are searched round their prediction | 6 in the middle pass
    //   raised the p95 of `rendered_c` from 0.47 to 0.56 mm, [solver-needs]
    static constexpr BySearch<uint32_t> kSearchRadius = {8, 4};
    // px of the level | likewise, in a wide search | [wide-search]
    static constexpr BySearch<uint32_t> kWideRadius = {12, 8};
    // steps | conjugate gradients in each iteration | [solver-needs]
    static constexpr ByPass<uint32_t> kCgIterations = {5, 10, 10};
    // of `arap_weight` | soft where patches are to be predicted closely enough for the next search:
    //   what a stiff surface takes back of a local deformation is lost | `rendered_c`,
    //   [local-deformation]
    static constexpr ByPass<float> kStiffness = {1, 0.2f, 1};
    // 1 | weight of the matches: the paper's while features alone tell where the surface went;
    //   then they only hold what has no patch | the paper's in the coarse
    //   pass; set by hand
    static constexpr ByPass<float> kMatchWeight = {10, 1, 0.5f};
    // px | width of Tukey's kernel over patches; wide at first: patches far off are what a local
    //   deformation looks like | set by hand
    static constexpr ByPass<float> kPatchTukey = {24, 24, 8};
    // mm | width of Tukey's kernel over live depth; narrowing: depth far off is more and more
    //   likely an instrument's | set by hand
    static constexpr ByPass<float> kIcpTukey = {3, 1.5f, 1};
};

// What the tracker sets otherwise than the stages' defaults.
struct StageParameters {
    // 1 | smoothing of disparities; the solver fits a smooth surface to them | [solver-needs]
    static constexpr uint32_t kSmoothPasses = 1;
    // 1/16 px of half resolution | a depth edge begins there: beside an instrument disparities mix
    //   with its own | largest error of an observed point of `indentation_640x360` 1.93 mm, not
    //   2.02
    static constexpr uint32_t kDepthEdge = 16;
    // levels | of the pyramid in which features are found; coarse ones are as good to begin what
    //   patches finish | [cost-of-speed]
    static constexpr uint32_t kFeatureLevels = 3;
    // px | the image is not halved below this width for features | [cost-of-speed]
    static constexpr uint32_t kMinFeatureWidth = 480;
    // px | nor below this height | [cost-of-speed]
    static constexpr uint32_t kMinFeatureHeight = 240;
    // vertices | along rows and columns, from one point of the solver to the next: neighbouring
    //   disparities share their windows | every third raised medians from 0.123 to 0.142 mm,
    //   [solver-needs]
    static constexpr int kSparseStep = 2;
    // 1 | weight of such a point | the reference sequences
    static constexpr float kIcpWeight = 2;
    // 1 | weight of rotations in the ARAP term: tissue bends more easily than it shears |
    //   `rendered_c`, [local-deformation]
    static constexpr float kRotationWeight = 40;
    // mm | scale in the weight of matches that ransac left at 0 | set by hand
    static constexpr float kMatchThreshold = 2;
    // rounds | reweighting in ransac | [cost-of-speed]
    static constexpr uint32_t kRansacIterations = 5;
    // px | both radii of stage stereo's windows where texture is faint | the largest there are;
    //   [faint-texture]
    static constexpr uint32_t kLargeStereoRadius = 6;
    // level of the pyramid | the image in which patches are searched in the right view, or the
    //   texture level: the rows of a few hundred count together | set by hand
    static constexpr uint32_t kRightSearchLevel = 1;
    // px of the level | how far | set by hand
    static constexpr uint32_t kRightSearchRadius = 8;
    // patches | of the first view that are searched in the right view, about | the CPU's frame time
    //   may grow by a tenth
    static constexpr size_t kRightPatches = 200;
};

// A dual quaternion of a stage is a motion only near the unit length.
struct StageOutput {
    // 1 | a smaller squared norm of a motion is an error of the plugin | set by hand
    static constexpr float kMinSquaredNorm = 0.5f;
    // 1 | likewise a larger one | set by hand
    static constexpr float kMaxSquaredNorm = 2;
};

// Which part of a large map the finer passes solve.
// Source: the frame times of [large-map]
struct MapPart {
    // of what a full image has | room of a part for connections and points | where tissue joined,
    //   connections are a tenth denser
    static constexpr double kRoom = 1.6;
    // of the room | a map with more connections is solved in part | choosing a part may take half
    //   as long as a frame
    static constexpr Ratio kSuits = {10, 9};
    // spacings of control points | so near the image control points must be solved
    static constexpr double kNeededSpacings = 1.5;
    // share of the image's side | and this much farther
    static constexpr double kNeededShare = 0.03;
    // share of the image's side | by which a part is chosen wider, as there is room
    static constexpr std::array<double, 4> kSlack = {0, 0.05, 0.1, 0.15};
    // 1 | the place in `slack` that is tried first
    static constexpr size_t kFirstSlack = 1;
    // frames | a part that lasted less is chosen wider
    static constexpr uint32_t kShort = 4;
    // frames | a part that lasted more is chosen narrower
    static constexpr uint32_t kLong = 16;
    // frames | one in so many is solved as a whole in the coarse pass, so that what lies outside of
    //   the image follows
    static constexpr uint32_t kWholeEvery = 8;
};

// What is left out of a frame that is short of time.
struct Deadlines {
    // of the expected time | must be left for a choice | frames differ; set by hand
    static constexpr double kMargin = 1.25;
    // 1 | share of the last frame in the mean of the times | set by hand
    static constexpr double kNewest = 0.25;
    // share per frame | by which the time of a choice that did not fit shrinks, so that it is tried
    //   again | what takes just too long makes one frame in 28 late
    static constexpr double kForgotten = 1 / 128.0;
};

// ---- the images ---------------------------------------------------------------------------------

// Whether an image can be used, and whether its rows are of two times.
struct Images {
    // px | between the pixels that are read, in rows and columns | set by hand
    static constexpr uint32_t kPixelStep = 4;
    // rows | pairs of rows of the image that are compared, about | set by hand
    static constexpr uint32_t kRowPairs = 64;
    // gray levels | a lower mean is `DEFREC_REASON_DARK` | set by hand
    static constexpr double kDark = 6;
    // gray levels | a pixel is saturated from here on | set by hand
    static constexpr uint32_t kSaturatedFrom = 250;
    // share of the pixels | more saturated ones are `DEFREC_REASON_SATURATED` | set by hand
    static constexpr double kSaturatedShare = 0.6;
    // gray levels | a lower standard deviation of both views is `DEFREC_REASON_NO_TEXTURE` | set by
    //   hand
    static constexpr double kMinDeviation = 1.5;
    // 1 | more is `DEFREC_REASON_INTERLACED`: the difference of rows beside each other over that of
    //   rows two apart | 0.54 to 0.97 in pictures of tissue, 1 in noise, [interlaced]
    static constexpr double kInterlacedRatio = 1.2;
    // 1/16 gray level | rows two apart that differ by less are not judged | rounding
    static constexpr uint64_t kMinRowDifference = 4;
    // frames | over which the usual step of the time stamps is a mean; a step of more than two
    //   usual ones is `DEFREC_REASON_GAP` | set by hand
    static constexpr int64_t kStepMemory = 8;
    // usual steps | a longer one counts as so many in that mean, else no gap was told for long
    // after
    //   a pause | 30 frames/s become 3 in six frames
    static constexpr int64_t kMostSteps = 4;
};

// How the rows of consecutive images follow each other in time. What is measured is how unlike the
// rows beside them rows are, in a picture woven of one image's top and another one's bottom field:
// its mean squared second difference, which grows with the squared time between the fields.
// Source: [fields]
struct ScanOrder {
    // rows | that are compared of an image, about | set by hand
    static constexpr uint32_t kRows = 256;
    // share | by which the larger of both mixed pictures exceeds that of the images at least, else
    //   too little moves | noise alone gives less than 0.01
    static constexpr double kMinExcess = 0.05;
    // 1 | the excess of the smaller one over that of the larger one: less is interlaced | 0 where
    //   fields are half a period apart, 1 in progressive video
    static constexpr double kInterlaced = 0.35;
    // 1 | the same: more is progressive
    static constexpr double kProgressive = 0.65;
};

// Whether a view, or a part of it, is the one of the frame before. A camera's noise leaves no
// textured block as it was.
struct FrozenImages {
    // px | side of a block | set by hand
    static constexpr uint32_t kBlock = 32;
    // px | the first row of a block that is compared | statistics of the image read it as well
    static constexpr uint32_t kFirstRow = 2;
    // px | from one such row to the next | set by hand
    static constexpr uint32_t kRowStep = 8;
    // gray levels | between extremes: a block has texture | noise alone has less
    static constexpr int kMinContrast = 8;
    // share of the blocks with texture | a view with as many frozen ones is frozen | a clock may
    //   run on
    static constexpr double kFrozenShare = 0.95;
    // share of the blocks with texture | a view with fewer frozen ones moves | compression may
    //   leave much of it as it was
    static constexpr double kMovingShare = 0.5;
    // px | of motion elsewhere, from which a frozen block says nothing | set by hand,
    //   [broken-assumptions]
    static constexpr float kStaleMotion = 0.5f;
    // share of the vertices in the image | observed outside of frozen blocks; fewer do not tell how
    //   the rest moved | set by hand
    static constexpr double kMinSeen = 0.05;
    // share of the vertices in the image | more in frozen blocks are `DEFREC_REASON_FROZEN` | set
    //   by hand
    static constexpr double kMinStaleShare = 0.05;
    // frames | as many repeated ones in a row come of a change of the frame rate or of a frame that
    //   was lost; after more nothing is observed | set by hand
    static constexpr uint32_t kMostRepeated = 2;
};

// ---- the state of a frame -----------------------------------------------------------------------

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
    // share of the vertices in the image | with depth that agrees, where depth is used | set by
    //   hand
    static constexpr double kMinDepthShare = 0.1;
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

// From where on a frame that was found has a reason. TrackerSettings has these members as well as
// the options: one that becomes an option goes from here to the header, under the same name.
struct Reasons {
    // share of the vertices in the image | more hidden by something in front are
    //   `DEFREC_REASON_OCCLUDED` | set by hand
    double occluded_share = 0.25;
    // of the share of the vertices with depth | as large a share of the patches is confirmed: where
    //   there is no depth, the tissue is covered | at least 0.65 beneath instruments and blood; at
    //   most 0.4 in `motion-blur`, 0.15 in `fat`
    static constexpr double kCoveredConfirmed = 0.5;
    // share of the vertices in the image | more without depth are `DEFREC_REASON_NO_DEPTH` | set by
    //   hand
    double no_depth_share = 0.5;
    // mm | a larger mean depth residual is `DEFREC_REASON_LARGE_RESIDUAL` | set by hand
    double large_residual = 1;
    // share of the vertices in the image | more in checks that are refuted are
    //   `DEFREC_REASON_CONTRADICTED` | [refuted-checks]: still and beating tissue have 0 to 0.05
    double contradicted_share = 0.05;
    // share of the first view's vertices | fewer in the image are `DEFREC_REASON_OUT_OF_VIEW` | set
    //   by hand
    double out_of_view_share = 0.5;
    // mm | from frame to frame: half of the vertices that move farther are
    //   `DEFREC_REASON_FAST_MOTION` | set by hand
    float fast_motion = 5;
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
    static constexpr double kMinDepthShare = 0.1;
    // share of the piece's vertices | in the image: the piece is expected there | set by hand
    static constexpr Ratio kExpectedShare = {1, 20};
};

// Where a piece went that is lost: RANSAC over the matches of its landmarks.
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

// ---- the confidence in a vertex -----------------------------------------------------------------

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
    // set
    //   by hand
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

// ---- the rig ------------------------------------------------------------------------------------

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
    // 0.023
    //   in each frame
    static constexpr double kLeast = 0.035;
    // logarithm per frame | by which the scale changes likewise before it and after it: the camera
    //   moves, and frames are missing | at most 0.015 in a beating heart, mostly not on both sides
    static constexpr double kNears = 0.008;
    // share of that change | by which, beyond the frame before, the picture may turn and move
    //   aside, lengths may change, and disparities may change otherwise than the scale
    static constexpr double kPure = 0.5;
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

// ---- the template changes -----------------------------------------------------------------------

// Which frames are looked at for new tissue.
struct Growth {
    // share of the image | without surface: more, and tissue is looked for while the camera moves |
    //   set by hand, [growth]
    static constexpr double kUncoveredMoving = 0.06;
    // share of the image | likewise once the camera rests | set by hand, [growth]
    static constexpr double kUncoveredResting = 0.015;
    // steps of the grid | side of the cells that are counted as covered or not | set by hand
    static constexpr double kCell = 3;
    // frames | since the last keyframe: the camera rests | set by hand
    static constexpr uint64_t kResting = 9;
    // frames | between the two keyframes that tissue joins by | set by hand
    static constexpr uint64_t kBetweenLooks = 3;
    // frames | from the later keyframe until tissue joins | set by hand
    static constexpr uint64_t kWorkFrames = 2;
    // frames | the longest pause after keyframes in vain | set by hand
    static constexpr uint64_t kMaxPause = 60;
};

// Points beside the surface, by the disparities round a pixel.
struct BesideSurface {
    // steps of the grid | disparities within this give the plane of a point | set by hand
    static constexpr double kBesideReach = 3;
    // px | and at least within this | set by hand
    static constexpr int kMinBesideReach = 3;
};

// Where the surface has come apart.
struct Cuts {
    // frames | with a gap at a cell, less those without, before it counts | set by hand
    static constexpr uint8_t kFrames = 5;
    // spacings of control points | length of a gap, at least | set by hand
    static constexpr double kMinLength = 3;
    // widths | length of a gap, at least | set by hand
    static constexpr double kMinSlimness = 2.5;
    // spacings of control points | across the line, to where the template is seen again | set by
    //   hand
    static constexpr double kReach = 5;
    // of the stretch along the gap | distance across it, over that at rest | tissue that is
    //   stretched by 36 % (`stretch`) shows no gap
    static constexpr double kMinOpening = 1.12;
    // spacings of control points | a cut reaches beyond the gap that is seen | set by hand
    static constexpr double kBeyond = 1;
    // steps of the grid | along the gap, to either side, over which its middle is a mean | set by
    //   hand
    static constexpr int kSmooth = 2;
};

// Where two sides of a surface slide along each other in contact, and where the line between them
// runs.
// Source: [sliding], where it names no other
struct Slips {
    // frames | without photometric evidence at a cell, less those with it, before it counts | a
    // band
    //   whose sides slide is told by these already
    static constexpr uint8_t kFrames = 3;
    // spacings of control points | across the band, to where the template is seen again | as cuts
    static constexpr double kReach = 5;
    // spacings of control points | side of the squares into which a band of more cells than one is
    //   divided | 2 and 3 find wrong lines, [line-ends]
    static constexpr double kSquare = 5;
    // spacings of control points | from a line that was released within which none is looked for |
    //   tissue there may count to the wrong side
    static constexpr double kBesideCut = 1.5;
    // spacings of control points | from there on, of what tells how a side moves
    static constexpr double kSideDepth = 3;
    // vertices | seen of a side, at least
    static constexpr size_t kMinSeen = 20;
    // cells | from one slice of the band to the next
    static constexpr size_t kSliceStep = 2;
    // of the length of a band | whose sides are known, at least | set by hand
    static constexpr double kMinSlices = 0.25;
    // slices | from a band's end, that tell where it goes on | set by hand
    static constexpr size_t kSlopeSlices = 8;
    // cells | of a part of a band, at least | fewer than a check has
    static constexpr size_t kMinCells = 4;
    // spacings of control points | length of a band in which a line goes on, at least | set by hand
    static constexpr double kMinGoingOn = 1;
    // directions | in which a part of a band may slide | set by hand
    static constexpr int kDirections = 8;
    // cosine | between the directions in which parts of a band slide, at least | half of what
    //   `kDirections` tells apart, and a half more
    static constexpr double kSameDirection = 0.8;
    // spacings of control points | between parts of a band, across the way they slide | set by hand
    static constexpr double kJoin = 4;
    // spacings of control points | and along it | [beside-lines]
    static constexpr double kJoinAlong = 10;
    // spacings of control points | by which the sides moved along each other, at least: a surface
    //   follows less
    static constexpr double kMinSlip = 1;
    // spacings of control points | between the motions of the nearest that is seen on either side
    // of
    //   a part of a band: less cannot be that much | set by hand
    static constexpr double kMayHaveSlid = 0.5;
    // of the median | what a slice slides at least to be alike
    static constexpr double kAlike = 0.5;
    // share of the slices | that must be alike
    static constexpr double kMinAlike = 0.8;
    // of the median along the line | what the sides moved otherwise, at most
    static constexpr double kMaxAside = 0.5;
    // ZNCC | of the better side: less tells nothing | as a check
    static constexpr double kMinZncc = 0.5;
    // ZNCC per cell | by which the line's place in a slice may differ from that in the next | set
    // by
    //   hand
    static constexpr double kBend = 0.3;
    // of the median | a line goes on to the surface's border, unless sides are seen on the way that
    //   slide less | where lines ended before it tissue was drawn between the sides, [line-ends]
    static constexpr double kEnds = 0.2;
    // spacings of control points | beyond the line's last slice, in which control points start from
    //   the motion of their side | set by hand
    static constexpr double kMovedBeyond = 3;
    // share of the image | a check so near the image's border says nothing | its window and search
    static constexpr double kMargin = 0.03;
    // samples | to each side of a window's middle, two pixels apart, four in large images | set by
    //   hand
    static constexpr int kWindowRadius = 3;
    // half steps between samples | how far a window is searched | set by hand
    static constexpr int kSearchRadius = 2;
};

// Where tissue left the place at which the surface has it.
// Source: [contradicted], where it names no other
struct Departure {
    // vertices | from one that is read to the next
    static constexpr size_t kStep = 3;
    // frames | from one in which is noted what was seen to the next, while nothing is seen
    // elsewhere
    //   | set by hand
    static constexpr uint32_t kSeenEvery = 8;
    // vertices | round a control point, as it moves them, at least | set by hand
    static constexpr float kMinWeight = 0.5f;
    // share of these | that show what the control point's tissue does | set by hand
    static constexpr float kMostOf = 0.5f;
    // share of these | fewer that are seen beside tissue that left went with it | set by hand
    static constexpr float kFewOf = 0.3f;
    // px of disparity | between the surface and the depth at which its image is seen, at least |
    //   frames blurred by 2 px at 320x240, whose depth errs by 2 mm at 0.5 px
    static constexpr float kMinPx = 1.5f;
    // control points | connected with one, that it leaves with at least | a flap has 19 to 28,
    // other
    //   scenes 1
    static constexpr uint32_t kMinNodes = 4;
    // frames | in a row, in which its image is seen elsewhere | set by hand
    static constexpr uint8_t kFrames = 1;
    // frames | in a row, in which it is seen again | set by hand
    static constexpr uint8_t kFramesBack = 3;
    // share of the vertices in the image | more that left degrade a frame, and are its reason
    static constexpr double kMaxShare = 0.05;
};

// Tissue that is lifted and hangs on the rest, where it is torn off and whether it is followed.
// Source: [following-a-flap], where it names no other
struct Lifted {
    // of the length at rest | a connection of control points as long asks for a look | set by hand
    static constexpr double kSuspicious = 1.15;
    // vertices | from one that tells how the whole moved to the next | set by hand
    static constexpr size_t kStep = 5;
    // rounds | of fitting the whole to what agrees with it | set by hand
    static constexpr int kRounds = 3;
    // mm | from where the whole moved, at least, between sides that are torn, and height of a tear
    //   | set by hand
    static constexpr double kMinMm = 2.5;
    // of the median distance of live depth from the surface | height of a tear, at least | flaps
    //   have 25 and more; 5 and 6 in `compressed` and `misaligned`, where nothing is torn
    static constexpr double kMinOfNoise = 12;
    // mm | from the surface, at most, of live depth that counts | that of instruments lies up to
    //   25 mm nearer
    static constexpr float kMaxResidual = 6;
    // share of the vertices with checks, in the image | that are seen, at least | set by hand
    static constexpr double kMinWhole = 0.5;
    // control points | as many vertices as lie round these are seen off their place, at least | as
    //   for tissue that left
    static constexpr double kMinNodes = 4;
    // of the distance at rest | farther apart is torn | `stretch` has 1.36
    static constexpr double kTorn = 1.4;
    // of the distance at rest | farther apart is torn beside what is | as a cut
    static constexpr double kMaybeTorn = 1.12;
    // of what the sides of a tear moved | towards the camera, at least: sides that slide move
    //   across, what is pressed moves away | set by hand
    static constexpr double kAlongSight = 0.5;
    // share of its outline | that is torn or may be, at least | a flap has 0.5, smoke 0.2
    static constexpr double kMinTornShare = 0.4;
    // share of its outline | at the image's border, at most | what instruments hide there has 0.5
    static constexpr double kMaxBorderShare = 0.25;
    // spacings of control points | from a tear within which tissue tells how its side goes on | set
    //   by hand
    static constexpr double kLevelReach = 2;
    // cells of the grid | beside a tear that do not tell it: live depth is smoothed across | set by
    //   hand
    static constexpr int kBlurred = 2;
    // vertices | that are seen and tell how a side of a tear goes on, at least | set by hand
    static constexpr int kMinBeside = 12;
    // spacings of control points | that are not torn between parts that are | set by hand
    static constexpr double kBridged = 2;
    // spacings of control points | length of a tear, at least | as a cut
    static constexpr double kMinLength = 3;
    // spacings of control points | by which it grows longer, at least | set by hand
    static constexpr double kMinLonger = 1.5;
    // spacings of control points | a tear reaches beyond what shows it | as a cut
    static constexpr double kBeyond = 1;
    // corners of cells | along the tear, to either side, over which it is a mean | set by hand
    static constexpr int kSmooth = 3;
    // frames | after it was parted, in which more of it is | later it hides what it came off, and
    //   what seems torn is not
    static constexpr uint32_t kGrowFrames = 3;
    // vertices | of lifted tissue, seen in two frames, that tell how it moves on | set by hand
    static constexpr size_t kMinSteps = 20;
    // share of the vertices of lifted tissue | that are seen where it is followed | set by hand
    static constexpr double kMinSeen = 0.3;
};

// ---- tissue that is not seen --------------------------------------------------------------------

// Whether something of another colour lies on the tissue, or is in front of it.
// Source: the rendered scenes of [another-colour]
struct TissueColours {
    // cells | of the width of the image, about | set by hand
    static constexpr uint32_t kAcross = 80;
    // pixels | of a cell's middle row that are read | set by hand
    static constexpr int kSamples = 4;
    // gray levels | of the brightest channel from which on a pixel is not read: a highlight has the
    //   lamp's colour
    static constexpr int kSaturated = 250;
    // gray levels | mean of a cell below which its colour is not known | set by hand
    static constexpr int kDarkest = 12;
    // frames | in which each vertex is learnt from once | set by hand
    static constexpr size_t kLearnEvery = 4;
    // share | of the way to what it has now that a vertex' colour takes each time | set by hand
    static constexpr float kForget = 0.25f;
    // vertices | of those that are looked at, with a known colour, without which nothing is covered
    //   | set by hand
    static constexpr float kMinVertices = 20;
    // 1 | change of chromaticity by which a vertex has another colour, at least | noise of
    //   compressed video is less
    static constexpr float kLeastChange = 0.05f;
    // of its distance from gray | likewise | set by hand
    static constexpr float kChangeShare = 0.4f;
    // standard deviations | of the tissue's colours, by which the colour lies beyond them | in
    //   `fold` all are nearer, metal and gauze are at 9 and 10, blood at 4 to 9
    static constexpr float kFar = 3.5f;
    // 1 | standard deviation of the tissue's chromaticity besides | set by hand
    static constexpr float kLeastSpread = 0.01f;
};

// The cells of the surface whose means tell where tissue is that is not seen.
// Source: the rendered scenes of [out-of-the-image]
struct UnseenCells {
    // width of the first view | side of a cell | cells of 60 px, not 80, cost seven times as much
    //   and gain 0.1 mm
    static constexpr double kCellShare = 1.0 / 8;
    // sides of a cell | between the centres of two cells
    static constexpr double kApart = 0.9;
    // cells | of a piece, at most
    static constexpr size_t kMaxCells = 56;
    // 1 | factor by which cells grow until there are no more
    static constexpr double kCellGrowth = 1.2;
    // share of the fullest cell's vertices | a cell with fewer goes to its neighbours
    static constexpr double kMinFullness = 0.3;
    // vertices | of a cell that are read
    static constexpr size_t kSamples = 50;
    // share of these | that must be observed
    static constexpr double kSeenShare = 0.05;
    // vertices | that must be observed at least
    static constexpr double kMinSeen = 3;
    // cells | that must be observed
    static constexpr std::ptrdiff_t kMinCells = 6;
    // distances between cells | spread of the observed cells across their main direction; less is a
    //   row
    static constexpr double kMinSpread = 0.35;
};

// How what the modes leave at the border of a hole is continued into it.
// Source: the rendered scenes of [another-colour]
struct HoleFill {
    // width of the first view | distance from which on one place tells nothing of another | half of
    //   it takes slopes less far in, means of neighbours keep none
    static constexpr double kReach = 0.5;
    // of the variance | that of a control point's own displacement | less follows noise into the
    //   hole
    static constexpr float kNoise = 0.003f;
    // connections | from the hole, of what it is continued from | one ring shows no slope
    static constexpr int kRings = 2;
    // control points | round a hole that are read, at most: each second one, and so on | time
    static constexpr size_t kMost = 96;
};

// The place of tissue that is not seen: universal kriging whose covariance is learnt.
// Source: the rendered scenes of [out-of-the-image]
struct UnseenMotion {
    // width of the first view | length of Matern's covariance | a length of 10 mm stays near the
    //   rigid motion
    static constexpr double kLengthShare = 0.4;
    // principal components of the cells' kernel | modes of displacement, at most | all of them
    //   place tissue no better, 20 do worse ([fewer-modes])
    static constexpr std::ptrdiff_t kModes = 24;
    // rounds | in which cells that the others foretell otherwise lose weight, at most
    static constexpr int kRaises = 2;
    // 1 | factor on a cell's variance from which on there is another round: it may have hidden
    //   others | chi-squared of three axes, over 3, which chance hardly reaches
    static constexpr double kStandsOut = 10;
    // cells | observed otherwise than in the frame before, at most: its weights are changed for
    //   them, and found anew once the result is out
    static constexpr size_t kMaxChanges = 18;
    // 1 | as kStandsOut, in a frame that goes by weights of one before
    static constexpr double kSurprise = 4;
    // 1 | factor on a cell's variance from which on it is observed otherwise
    static constexpr double kNoiseRatio = 2;
    // mm | of a cell's mean, per axis
    static constexpr double kNoise = 0.05;
    // of the squared expected error | variance of a cell's mean besides: errors of neighbouring
    //   vertices are alike
    static constexpr double kErrorShare = 2;
    // mm | standard deviation of displacements before anything is learnt
    static constexpr double kStart = 1;
    // frames | for which that counts
    static constexpr double kStartFrames = 4;
    // per frame | share of its weight that a frame keeps
    static constexpr double kForget = 0.985;
    // frames | of which one is learnt from, where something is hidden and nothing is outside
    static constexpr uint32_t kLearnEvery = 4;
    // of the kriging variance | expected error | fitted to rendered scenes
    static constexpr double kVarianceShare = 0.7;
    // control points | of a piece that must be hidden, where none is out of the image | set by
    //   hand: a single highlight is not worth the time
    static constexpr uint32_t kMinHidden = 4;
    // of the weights by which it moves vertices | a control point with as much of it covered at the
    //   depth of the surface, or behind, is hidden | more lets lm draw it to the cover, less takes
    //   seen tissue along ([another-colour])
    static constexpr float kCoveredShare = 0.2f;
    // of lm's covariance | variance of hidden tissue, [hidden-tissue]
    static constexpr double kLmShare = 0.4;
    // of the squared distance from where lm has it | variance of hidden tissue, [hidden-tissue]
    static constexpr double kStepShare = 0.3;
    // of the mean squared distance of what is seen from the modes | variance besides where a cut
    //   parts the surface | at the sides it is as much: five times the root mean square;
    //   [line-ends]
    static constexpr double kMisfit = 25;
    // mm | largest error besides, of tissue that is far and long unseen | fitted to rendered scenes
    static constexpr double kMost = 0.8;
    // mm | distance from what is seen at which tissue is far | fitted to rendered scenes
    static constexpr double kFar = 20;
    // frames | since it was seen, after which tissue is long unseen | fitted to rendered scenes
    static constexpr uint32_t kLong = 15;
};

// Whether a point lies on the surface or beneath it, and what beneath it is known.
struct BeneathSurface {
    // steps of the grid | a point so near a vertex may lie on the surface | set by hand
    static constexpr double kNearSteps = 2.5;
    // steps of the grid | it does where its depth is no more than this | set by hand
    static constexpr double kOnSurfaceSteps = 0.5;
    // mm | and this much | set by hand
    static constexpr double kOnSurface = 0.1;
    // mm | further depth over which the surface's answer passes into the body's | set by hand
    static constexpr double kBlend = 3;
    // vertices | of a piece that give its rigid motion where there is no body, at most | set by
    //   hand
    static constexpr size_t kRigidVertices = 400;
    // mm | depth over which the surface's own motion fades where there is no body | set by hand
    static constexpr double kRigidFade = 10;
    // share | less seen of what a point depends on: it is unknown | set by hand
    static constexpr double kMinEvidence = 0.02;
    // mm | a point with a larger expected error is unknown | set by hand
    static constexpr double kMaxError = 10;
    // mm | a point farther beyond the body is unknown | set by hand
    static constexpr double kMaxBeyond = 20;
};

// The variance of the error of a point beneath the surface is a sum of shares.
// Source: chosen on the first three groups of bodies of docs/api/beneath.md, their growth with the
//   depth on all four
struct BeneathError {
    // 1 | the surface's squared error: errors of many vertices go into one point
    static constexpr double kSurface = 0.04;
    // 1 | the squared deformation that reaches the point, times c + (depth / `depth`)^2: other
    //   bodies would make something else of it
    static constexpr double kDeformation = 0.12;
    // 1 | likewise its squared shift against what lies deep
    static constexpr double kShift = 0.01;
    // 1 | c
    static constexpr double kConstant = 0.13;
    // mm | see `deformation`
    static constexpr double kDepth = 29;
    // mm | depth counts up to here
    static constexpr double kDeepest = 75;
    // 1 | the squared distance of the rigid motions that could be chosen for what lies deep
    static constexpr double kChoice = 0.05;
    // mm^2 | of every point
    static constexpr double kFloor = 0.0007;
    // 1 | the squared distance from the body
    static constexpr double kBeyond = 0.02;
    // 1 | the mean square of what the rest of the surface does, where nothing was seen of what the
    //   point depends on
    static constexpr double kActivity = 1.5;
    // mm^2 | and besides
    static constexpr double kUnseen = 0.25;
};

}  // namespace defrec::decisions
