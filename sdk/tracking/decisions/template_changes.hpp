// The numbers by which the tracker decides that its template changes: it grows, is cut, slides
// along itself, or tissue leaves it, as scripts/decisions/header.py reads them: unit | what it
// decides | source.
#pragma once
#include <cstddef>
#include <cstdint>

namespace defrec::decisions {

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

// Gaps show that the surface has come apart.
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

// Two sides of a surface slide along each other in contact, and a line between them is found.
// Source: [sliding], where it names no other
struct Slips {
    // frames | without photometric evidence at a cell, less those with it, before it counts | a
    //   band whose sides slide is told by these already
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
    //   of a part of a band: less cannot be that much | set by hand
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
    //   by hand
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

// Tissue left the place at which the surface has it.
// Source: [contradicted], where it names no other
struct Departure {
    // vertices | from one that is read to the next
    static constexpr size_t kStep = 3;
    // frames | from one in which is noted what was seen to the next, while nothing is seen
    //   elsewhere | set by hand
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
    //   other scenes 1
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

}  // namespace defrec::decisions
