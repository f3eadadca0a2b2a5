// Defaults of the parameters of stage stereo, for whoever creates the stage.
#pragma once
#include "include/defrec_c.h"

namespace defrec {

// Replaces every zero that means "default".
inline void fill_defaults(defrec_stereo_params& params) {
    const auto set = [](uint32_t& value, uint32_t otherwise) {
        if (value == 0) value = otherwise;
    };
    params.struct_size = sizeof params;
    set(params.stride, params.width);
    set(params.disparities, 128);
    set(params.radius, 4);
    set(params.refine_radius, 4);
    set(params.min_score, 1600);
    set(params.refine_score, 2000);
    set(params.uniqueness, 40);
    set(params.texture, 8);
    set(params.left_right, 1);
    set(params.edge, 24);
    set(params.support, 10);
    set(params.fill_radius, 6);
    set(params.smooth_radius, 3);
    set(params.smooth_range, 24);
    set(params.smooth_passes, 4);
}

}  // namespace defrec
