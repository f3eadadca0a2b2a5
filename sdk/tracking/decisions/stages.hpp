// The numbers that the tracker hands to the stages, and by which it decides what they solve and
// what they leave out, as scripts/decisions/header.py reads them: unit | what it decides | source.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "sdk/base/util/ratio.hpp"

namespace defrec::decisions {

// Values for the solver's passes, and for the searches of patches before the last two.
template <class T>
struct ByPass {
    T coarse, middle, fine;
};
template <class T>
struct BySearch {
    T middle, fine;
};

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

// The tracker sets these parameters otherwise than the stages' defaults.
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

// A frame that is short of time leaves parts out.
struct Deadlines {
    // of the expected time | must be left for a choice | frames differ; set by hand
    static constexpr double kMargin = 1.25;
    // 1 | share of the last frame in the mean of the times | set by hand
    static constexpr double kNewest = 0.25;
    // share per frame | by which the time of a choice that did not fit shrinks, so that it is tried
    //   again | what takes just too long makes one frame in 28 late
    static constexpr double kForgotten = 1 / 128.0;
};

}  // namespace defrec::decisions
