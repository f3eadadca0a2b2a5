// Defaults of the stage align's parameters, and the limits of every backend.
#pragma once
#include <string>

#include "backends/shared/stage.hpp"

namespace defrec {

inline void fill_defaults(defrec_align_params& params) {
    if (params.views == 0) params.views = 1;
    if (params.stride == 0) params.stride = params.width;
    if (params.patch_radius == 0) params.patch_radius = 5;
    if (params.search_radius == 0) params.search_radius = 4;
    if (params.min_score == 0) params.min_score = 2867;
    if (params.texture == 0) params.texture = 16;
}

constexpr int32_t kAlignMaxLevel = 3, kAlignMaxPatchRadius = 7, kAlignMaxSearchRadius = 16;

// Throws unless the parameters are complete and within the limits of docs/stages/align.md.
inline void check_limits(const defrec_align_params& params) {
    const auto refuse = [](const std::string& text) {
        throw StageError(DEFREC_ERROR_UNSUPPORTED, "align: " + text);
    };
    if (params.level > uint32_t(kAlignMaxLevel))
        refuse("level " + std::to_string(params.level) + " given, 0 to 3 supported");
    if (params.patch_radius < 1 || params.patch_radius > uint32_t(kAlignMaxPatchRadius))
        refuse("patch_radius " + std::to_string(params.patch_radius) + " given, 1 to 7 supported");
    if (params.search_radius < 1 || params.search_radius > uint32_t(kAlignMaxSearchRadius))
        refuse("search_radius " + std::to_string(params.search_radius) +
               " given, 1 to 16 supported");
    if (params.width < DEFREC_MIN_WIDTH || params.height < DEFREC_MIN_HEIGHT ||
        params.width > DEFREC_MAX_SIDE || params.height > DEFREC_MAX_SIDE ||
        params.stride < params.width)
        refuse("images of " + std::to_string(params.width) + " x " + std::to_string(params.height) +
               ", stride " + std::to_string(params.stride) +
               " given, 64 x 48 to 8192 x 8192 supported");
    if (params.views < 1) refuse("no views given");
}

}  // namespace defrec
