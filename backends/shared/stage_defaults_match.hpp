// Defaults of the stage match; docs/stages/match.md names them.
#pragma once
#include "include/defrec_c.h"

namespace defrec {

inline void fill_defaults(defrec_match_params& params) {
    if (params.max_distance == 0) params.max_distance = 64;
    if (params.ratio == 0) params.ratio = 218;
    if (params.stride == 0) params.stride = params.width;
}

}  // namespace defrec
