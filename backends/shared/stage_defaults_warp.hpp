// Defaults of the stage warp; docs/stages/warp.md names them.
#pragma once
#include "include/defrec_c.h"

namespace defrec {

inline void fill_defaults(defrec_warp_params& params) {
    if (params.stride == 0) params.stride = params.width;
    if (params.tolerance_mm == 0) params.tolerance_mm = 2.0f;
}

}  // namespace defrec
