// The numbers by which the tracker decides what images by themselves say: of use, of two times,
// frozen, as scripts/decisions/header.py reads them: unit | what it decides | source.
#pragma once
#include <cstdint>

namespace defrec::decisions {

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
    //   after a pause | 30 frames/s become 3 in six frames
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

}  // namespace defrec::decisions
