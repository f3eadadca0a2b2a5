// The numbers by which a video is found to be strongly compressed, as scripts/decisions/header.py
// reads them: unit | what it decides | source. [name] is a page of docs/experiments.
#pragma once

#include <cstddef>

namespace defrec::decisions {

// A block that a codec copied from the frame before.
struct CopiedBlock {
    // px | the side of a block, and of the grid on which it lies | H.264's macroblock
    static constexpr int kSide = 16;
    // px | its place in the frame before, in either direction, at most | set by hand
    static constexpr int kReach = 6;
    // gray levels | mean difference, at most; conversion from YUV rounds | two pictures of a camera
    //   whose noise is 0.5 differ by 0.56
    static constexpr double kMaxDifference = 0.25;
    // gray levels | mean step from pixel to pixel in either direction, at least: texture | set by
    //   hand
    static constexpr int kMinStep = 1;
    // gray levels | a darker block is no tissue but a border | set by hand
    static constexpr int kMinGray = 10;
    // share of the blocks with texture | more that stand still: the frame is a repeated one | set
    //   by hand
    static constexpr double kRepeated = 0.9;
    // blocks | in all pairs of frames: fewer say nothing | set by hand
    static constexpr int kMinBlocks = 200;
};

// The borders of blocks that a codec rounded each by itself.
struct BlockBorder {
    // px | the side of a block, and of the grid on which it lies | JPEG's, MPEG's
    static constexpr std::size_t kSide = 8;
    // gray levels | between neighbours; a larger step counts as one of these: an edge | set by hand
    static constexpr int kMaxStep = 20;
    // gray levels | a darker pixel is no tissue but a bar or a border, whose own edge may lie on
    // the
    //   grid | as CopiedBlock
    static constexpr int kMinGray = 10;
};

// A video of which a codec left too little.
struct CompressedVideo {
    // frames | the first ones, which are looked at | half a second
    static constexpr int kFrames = 12;
    // times the median over the places in a block | the change of gray levels at its border, above
    //   which a video is strongly compressed | [doctor]
    static constexpr double kBorderRatio = 1.25;
    // share of the blocks with texture | more that are copies: strongly compressed | 0 without a
    //   codec; 0.003 at rate factor 18, 0.007 to 0.017 at 23, [compressed]
    static constexpr double kMostCopied = 0.005;
    // share of the surface | without depth in these frames, from which the video is of no use | set
    //   by hand, [compressed]
    static constexpr double kMostWithoutDepth = 0.5;
};

}  // namespace defrec::decisions
