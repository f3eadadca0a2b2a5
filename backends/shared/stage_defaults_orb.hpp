// Defaults of the stage orb; docs/stages/orb.md names them.
#pragma once
#include "include/defrec_c.h"

namespace defrec {

inline void fill_defaults(defrec_orb_params& params) {
    if (params.stride == 0) params.stride = params.width;
    if (params.levels == 0) params.levels = 4;
    if (params.cell == 0) params.cell = 8;
    if (params.threshold == 0) params.threshold = 3;
    if (params.capacity == 0) params.capacity = 2048;
    if (params.spacing == 0) params.spacing = 4;
}

}  // namespace defrec
