// See template_patches.hpp.
#include "sdk/tracking/stages/template_patches.hpp"

#include "sdk/template/scattered_blend_weights.hpp"
#include "sdk/tracking/stages/make_stage.hpp"
#include "sdk/tracking/stages/template_buffers.hpp"

namespace defrec {

// Patches of the first view are strained; those of tissue that joined, whose control points are on
// no such grid, are only turned.
std::vector<defrec_patch_slope> slopes_of(const TemplateData& data,
                                          const std::vector<defrec_patch>& patches) {
    std::vector<defrec_patch_slope> slopes;
    slopes.reserve(patches.size());
    for (const defrec_patch& patch : patches)
        slopes.push_back(patch.view == 0
                             ? grid_slope(data.node_grid, data.piece_of(patch), patch.u, patch.v)
                             : scattered_slope(data.nodes, patch));
    return slopes;
}

defrec_align_params align_params(const defrec_camera& camera, const TemplateData& data,
                                 uint32_t patches) {
    auto align = make_params<defrec_align_params>();
    align.patches = patches;
    align.nodes = node_count(data);
    align.views = static_cast<uint32_t>(data.views());
    align.width = data.width;
    align.height = data.height;
    align.camera = camera;
    return align;
}

}  // namespace defrec
