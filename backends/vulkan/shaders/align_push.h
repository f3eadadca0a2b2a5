// What a run of stage align gives to its shaders beside the constants, for C++ and GLSL.
#ifdef __cplusplus
#pragma once
namespace defrec::vulkan {
#endif

struct AlignRun {
    int stride;   // of the live image and its mask at the level
    int patches;  // as many as prepare was given
    int masked;   // 1: there is a mask
};

// Size of the level, which is stored densely; stride: of the image.
struct AlignLevelSize {
    int width, height, stride;
};

#ifdef __cplusplus
}  // namespace defrec::vulkan
#endif
