// The rig that films a rendered scene, as the C API takes it.
#pragma once
#include <algorithm>

#include "include/defrec_c.h"
#include "sdk/cli/render/film.hpp"

namespace defrec::test {

inline defrec_intrinsics intrinsics_of(const cli::Lens& lens) {
    return {lens.fx, lens.fy, lens.cx, lens.cy, {}, 0, 0};
}

// Of a scene whose cameras are rectified and without distortion. width, height: of the film.
inline void describe_rig(const cli::StereoRig& filmed, uint32_t width, uint32_t height,
                         defrec_rig_desc& rig) {
    rig.width = width;
    rig.height = height;
    rig.left = intrinsics_of(filmed.left);
    rig.right = intrinsics_of(filmed.right);
    std::copy_n(filmed.translation.data(), 3, rig.translation);
}

}  // namespace defrec::test
