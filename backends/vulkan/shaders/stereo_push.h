// What a run of stage stereo gives to its shaders beside the constants, for C++ and GLSL.
#ifdef __cplusplus
#pragma once
namespace defrec::vulkan {
#endif

// 1: the buffer is given.
struct StereoGiven {
    int mask;  // of the image that is prepared; of the right one in the refinement
    int left_mask;
    int refined, score, confidence;
};

// Of a field that is smoothed, px; to_stride: elements of the result from row to row.
struct SmoothSize {
    int width, height, to_stride;
};

// Of the half images, px; and the level of the pyramid that a shader begins with.
struct PyramidLevel {
    int width, height, level;
};

#ifdef __cplusplus
}  // namespace defrec::vulkan
#endif
