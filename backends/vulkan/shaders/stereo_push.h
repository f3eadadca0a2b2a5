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
const int kOutConfidence = 1, kOutLeftGray = 2, kOutRightGray = 3, kOutLeftKeys = 4,
          kOutChecked = 6, kOutHalfRefined = 9, kOutHypothesis = 10, kOutRefined = 11,
          kOutScore = 12, kOutEvidence = 13;

// Sizes of the samples that are smoothed, and of the result; stride: elements of the result from
// row to row.
struct SmoothSize {
    int samples_x, samples_y, width, height, stride;
};

// Left samples of a work group of stereo_search_wide.comp in a row, of an invocation, and rows.
const int kWideSearchTile = 32, kWideSearchRun = 4, kWideSearchRows = 4;
// Samples of a work group of stereo_refine_wide.comp.
const int kWideRefineWidth = 16, kWideRefineHeight = 8;

#ifdef __cplusplus
}  // namespace defrec::vulkan
#endif
