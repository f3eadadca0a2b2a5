// Defaults of the stage lm; docs/stages/lm.md explains them.
#pragma once
#include "include/defrec_c.h"

namespace defrec {

inline void fill_defaults(defrec_lm_params& params) {
    const auto fill = [](auto& value, auto standard) {
        if (value == 0) value = standard;
    };
    fill(params.solver, uint32_t(DEFREC_SOLVER_COUPLED));
    fill(params.stride, params.width);
    fill(params.iterations, 10u);
    fill(params.cg_iterations, 20u);
    fill(params.node_spacing_mm, 5.0f);
    fill(params.icp_weight, 1.0f);
    fill(params.match_weight, 10.0f);
    fill(params.patch_weight, 10.0f);
    fill(params.arap_weight, 1.0f);
    fill(params.length_weight, 1.0f);
    fill(params.angle_weight, 20.0f);
    fill(params.rotation_weight, 100.0f);
    fill(params.icp_tukey_mm, 3.0f);
    fill(params.match_tukey_mm, 5.0f);
    fill(params.patch_tukey_px, 4.0f);
    fill(params.association_mm, 10.0f);
    fill(params.damping, 1e-3f);
    fill(params.match_threshold_mm, 2.0f);
}

}  // namespace defrec
