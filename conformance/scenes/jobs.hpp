// Jobs of each stage from what they are about, as most cases need them.
#pragma once
#include "conformance/scenes/picture.hpp"
#include "conformance/worker/stage_job.hpp"

namespace defrec::conformance {

// A parameter struct of zeroes, which mean defaults, with its size.
template <class Params>
Params blank() {
    Params params;
    DEFREC_INIT(&params);
    return params;
}

inline Input picture_input(const Gray& picture, uint32_t stride) {
    return image_input(picture.pixels, picture.width, picture.height,
                       std::max(stride, picture.width));
}

// Pixels of the format, from the picture: its channels are the gray values shifted a little.
Input colour_input(const Gray& picture, uint32_t format, uint32_t stride_bytes);

// The argument extras says whether optional outputs are asked for.
StageJob rectify_job(const defrec_rectify_params& params, const Gray& source,
                     const std::vector<int32_t>* map, const Gray* ignore);
// A map that turns and bends the picture, some pixels outside of it.
std::vector<int32_t> bent_map(const defrec_rectify_params& params, uint64_t seed);

StageJob stereo_job(const defrec_stereo_params& params, const Gray& left, const Gray& right,
                    const Gray* left_mask, const Gray* right_mask, bool extras = true);
StageJob orb_job(const defrec_orb_params& params, const Gray& picture, const Gray* mask,
                 bool extras = true);

}  // namespace defrec::conformance
