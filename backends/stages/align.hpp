// Contract of stage align: constants, buffers and checks, once for all backends.
// docs/stages/align.md. Shaders include this file as well, for the part outside __cplusplus.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/align_constants.h"
#include "backends/stages/surface.hpp"
#ifdef __cplusplus
#include <algorithm>
#include <vector>

namespace defrec {
#endif

struct AlignConstants {
    FloatCamera camera;
    float live_x;   // of the live image's camera in the rectified camera's frame, mm
    float live_cx;  // of the live image, px
    float max_x, max_y,
        margin;         // of a prediction: largest coordinates, and how far from the border, px
    int max_u, max_v;   // largest coordinates of a prediction, 1/256 px
    int width, height;  // of the live image at the level, px
    int view_width, view_height;  // of a view at the level, doubled
    uint texture;
    int level, min_score;
    int patch_radius, search_radius;  // px of the level
    int keep_predicted;
};

// A patch's centre in its view, 1/256 px of the level; valid 0: no such place.
struct AlignCentre {
    int x, y, view, valid;
};

#ifdef __cplusplus
constexpr AlignConstants constants_of(const defrec_align_params& p) {
    const int32_t width = int32_t(p.width >> p.level), height = int32_t(p.height >> p.level);
    return {.camera = float_camera(p.camera),
            .live_x = p.right_view != 0 ? float(p.camera.baseline_mm) : 0.0f,
            .live_cx =
                float(p.right_view != 0 ? p.camera.cx + p.camera.disparity_offset_px : p.camera.cx),
            .max_x = float(p.width - 1),
            .max_y = float(p.height - 1),
            .margin = float((p.patch_radius + 2) << p.level),
            .max_u = int32_t(p.width - 1) * kPatchOne,
            .max_v = int32_t(p.height - 1) * kPatchOne,
            .width = width,
            .height = height,
            .view_width = 2 * width,
            .view_height = 2 * height,
            .texture = p.texture,
            .level = int32_t(p.level),
            .min_score = int32_t(p.min_score),
            .patch_radius = int32_t(p.patch_radius),
            .search_radius = int32_t(p.search_radius),
            .keep_predicted = int32_t(p.keep_predicted)};
}

// The parameters with a least score and a least texture that the arithmetic holds: no larger than
// ones that no patch reaches.
constexpr defrec_align_params bounded(defrec_align_params params) {
    params.min_score = std::min(params.min_score, uint32_t{kScoreOne} + 1);
    params.texture = std::min(params.texture, align::kTooMuchTexture);
    return params;
}

// Bytes of the live image or its mask, and where a view begins among all of them.
constexpr uint64_t gray_bytes(const defrec_align_params& params) {
    return image_elements(params.width, params.height, params.stride);
}
constexpr uint64_t view_offset(const defrec_align_params& params, size_t view) {
    return uint64_t{view} * params.stride * params.height;
}

struct AlignTemplateBuffers {
    static constexpr const char* kName = "align prepare";
    const defrec_patch* patches;
    const uint8_t* views;
    const defrec_patch_slope* slopes;  // nullptr: all 0

    template <class List>
    void list(List& list, const defrec_align_params& params) {
        list.input("patches", patches, 0);  // as many as there are
        list.input("views", views, view_offset(params, params.views - 1) + gray_bytes(params));
        list.optional_input("slopes", slopes, 0);  // as many as there are patches
    }
};

// What prepare is given: as many patches as the buffer holds, at most params.patches, and the
// views.
struct AlignTemplate {
    std::span<const defrec_patch> patches;
    const uint8_t* views;
    std::vector<defrec_patch_slope> slopes;  // of each patch; 0 where none were given
};
// Throws unless every patch names a view and control points that exist, all numbers but its place
// in the view are finite, and slopes, if there are any, are as many.
inline AlignTemplate read_template(const defrec_align_params& params,
                                   std::span<const InBuffer> in) {
    const auto given = view_buffers<AlignTemplateBuffers>(params, in);
    const std::span patches(given.patches,
                            std::min<size_t>(params.patches, in[0].size / sizeof(defrec_patch)));
    check_blended("align: patch", patches.data(), patches.size(), params.nodes);
    const auto refuse = [](size_t patch, const char* text) {
        throw StageError(DEFREC_ERROR_ARGUMENT, "align: patch " + std::to_string(patch) + text);
    };
    for (size_t i = 0; i < patches.size(); ++i) {
        const defrec_patch& patch = patches[i];
        if (patch.view < 0 || uint32_t(patch.view) >= params.views)
            refuse(i, " names a view that does not exist");
        if (!all_finite(patch.tangent_u, 3) || !all_finite(patch.tangent_v, 3))
            refuse(i, " has a tangent that is not finite");
    }
    std::vector<defrec_patch_slope> slopes(patches.size());
    if (given.slopes != nullptr) {
        if (in[2].size < patches.size() * sizeof(defrec_patch_slope))
            throw StageError(DEFREC_ERROR_ARGUMENT,
                             "align: slopes of " +
                                 std::to_string(in[2].size / sizeof(defrec_patch_slope)) +
                                 " patches, there are " + std::to_string(patches.size()));
        std::copy_n(given.slopes, slopes.size(), slopes.begin());
        for (size_t i = 0; i < slopes.size(); ++i)
            if (!all_finite(slopes[i].weight_u, DEFREC_BLEND_NODES) ||
                !all_finite(slopes[i].weight_v, DEFREC_BLEND_NODES))
                refuse(i, " has a slope that is not finite");
    }
    return {patches, given.views, std::move(slopes)};
}

struct AlignBuffers {
    static constexpr const char* kName = "align";
    const uint8_t* gray;
    const uint8_t* mask;                   // nullptr: all is usable
    const defrec_motion* motions;          // nullptr where predictions are given
    const defrec_patch_prediction* given;  // predictions; nullptr: made from the motions
    defrec_patch_observation* observations;
    defrec_patch_prediction* predictions;  // may be nullptr

    // patches: as many as prepare was given; 0 while that is not known.
    struct Sizes {
        const defrec_align_params& params;
        uint64_t patches = 0;
    };
    template <class List>
    void list(List& list, const Sizes& sizes) {
        list.input("gray", gray, gray_bytes(sizes.params));
        list.optional_input("mask", mask, gray_bytes(sizes.params));
        list.optional_input("motions", motions, sizes.params.nodes);
        list.optional_input("predictions", given, sizes.patches);
        list.output("observations", observations, sizes.patches);
        list.optional_output("predictions out", predictions, sizes.patches);
    }
};
inline AlignBuffers align_buffers(const defrec_align_params& params, uint64_t patches,
                                  std::span<const InBuffer> in, std::span<const OutBuffer> out) {
    const auto buffers = view_buffers<AlignBuffers>(AlignBuffers::Sizes{params, patches}, in, out);
    if (buffers.motions == nullptr && buffers.given == nullptr && patches > 0)
        throw StageError(DEFREC_ERROR_ARGUMENT, "align: neither motions nor predictions given");
    return buffers;
}
inline BufferTable buffer_table(const defrec_align_params& params) {
    return table_of<AlignBuffers>(AlignBuffers::Sizes{params});
}

}  // namespace defrec
#endif
