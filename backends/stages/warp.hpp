// Contract of stage warp: constants, buffers and checks, once for all backends.
// docs/stages/warp.md. Shaders include this file as well, for the part outside __cplusplus.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/warp_constants.h"
#include "backends/stages/surface.hpp"
#ifdef __cplusplus
namespace defrec {
#endif

struct WarpConstants {
    FloatCamera camera;
    uint points;
    float tolerance_mm;
};

#ifdef __cplusplus
constexpr WarpConstants constants_of(const defrec_warp_params& params) {
    return {float_camera(params.camera), params.points, params.tolerance_mm};
}

struct WarpTemplate {
    static constexpr const char* kName = "warp prepare";
    const defrec_surface_point* points;

    template <class List>
    void list(List& list, const defrec_warp_params& params) {
        list.input("points", points, params.points);
    }
};
// Throws unless every point can be moved.
inline WarpTemplate read_template(const defrec_warp_params& params, std::span<const InBuffer> in) {
    const auto given = view_buffers<WarpTemplate>(params, in);
    check_blended("warp: point", given.points, params.points, params.nodes);
    return given;
}

struct WarpBuffers {
    static constexpr const char* kName = "warp";
    const defrec_motion* motions;
    const int16_t* disparity;  // nullptr: none
    defrec_surface_sample* samples;

    template <class List>
    void list(List& list, const defrec_warp_params& params) {
        list.input("motions", motions, params.nodes);
        list.optional_input("disparity", disparity, disparity_elements(params));
        list.output("samples", samples, params.points);
    }
};
inline BufferTable buffer_table(const defrec_warp_params& params) {
    return table_of<WarpBuffers>(params);
}

}  // namespace defrec
#endif
