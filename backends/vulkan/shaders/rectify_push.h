// What a run of stage rectify gives to its shaders beside the constants, for C++ and GLSL.
#ifdef __cplusplus
#pragma once
namespace defrec::vulkan {
#endif

struct RectifyGiven {
    int map, ignore;  // 1: there is one
};

#ifdef __cplusplus
}  // namespace defrec::vulkan
#endif
