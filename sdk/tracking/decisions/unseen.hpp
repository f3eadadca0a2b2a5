// The numbers by which the tracker decides where tissue is that is covered or out of the image, as
// scripts/decisions/header.py reads them: unit | what it decides | source.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec::decisions {

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

}  // namespace defrec::decisions
