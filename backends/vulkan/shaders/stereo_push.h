// What a run of stage stereo gives to its shaders beside the constants, for C++ and GLSL.
#ifdef __cplusplus
#pragma once
namespace defrec::vulkan {
#endif

struct StereoGiven {
    int mask;  // 1: it is given, of the image that is prepared; of the right one in the refinement
    int left_mask;
    int outputs;  // bit i: output i is given
};
// Outputs that shaders write only if they are given.
const int kOutConfidence = 1, kOutLeftGray = 2, kOutRightGray = 3, kOutChecked = 6,
          kOutHalfRefined = 9, kOutHypothesis = 10, kOutRefined = 11, kOutScore = 12,
          kOutEvidence = 13;

// Of the samples that are smoothed, and of the result; stride: elements of the result from row to
// row.
struct SmoothSize {
    int samples_x, samples_y, width, height, stride;
};

const int kTileLevels = 5;  // fields coarser than a tile's that the tile's work group makes

#ifdef __cplusplus
}  // namespace defrec::vulkan
#endif
