// The buffers of the stage align, checked and typed. docs/stages/align.md lists them.
#pragma once
#include <algorithm>
#include <string>

#include "backends/shared/stage.hpp"

namespace defrec {

// Bytes of the live image or its mask, and of all views: the last row may end with its last pixel.
inline size_t gray_size(const defrec_align_params& params) {
    return size_t(params.stride) * (params.height - 1) + params.width;
}
inline size_t view_offset(const defrec_align_params& params, size_t view) {
    return view * params.stride * params.height;
}

// The patches given to prepare: as many as the buffer holds, at most params.patches. Throws unless
// they name views and control points that exist.
inline std::span<const defrec_patch> take_patches(const defrec_align_params& params,
                                                  const InBuffer& buffer) {
    const size_t count = std::min<size_t>(params.patches, buffer.size / sizeof(defrec_patch));
    const std::span<const defrec_patch> patches(buffer.as<defrec_patch>(), count);
    for (size_t i = 0; i < count; ++i) {
        bool good = patches[i].view >= 0 && uint32_t(patches[i].view) < params.views;
        for (const int32_t node : patches[i].node)
            good = good && node >= 0 && uint32_t(node) < params.nodes;
        if (!good)
            throw StageError(DEFREC_ERROR_ARGUMENT,
                             "align: patch " + std::to_string(i) +
                                 " names a view or a control point that does not exist");
    }
    return patches;
}

// The buffers of one run; optional ones are nullptr where not given.
struct AlignBuffers {
    const uint8_t *gray, *mask;
    const defrec_motion* motions;
    const defrec_patch_prediction* given;
    defrec_patch_observation* observations;
    defrec_patch_prediction* predictions;
};
inline AlignBuffers take_buffers(const defrec_align_params& params, size_t patches,
                                 std::span<const InBuffer> in, std::span<const OutBuffer> out) {
    expect_buffers("align: in", in, 1, 3);
    expect_buffers("align: out", out, 1, 1);
    const AlignBuffers buffers = {
        take<uint8_t>("align: gray", in[0], gray_size(params)),
        take_optional<uint8_t>("align: mask", in, 1, gray_size(params)),
        take_optional<defrec_motion>("align: motions", in, 2, params.nodes),
        take_optional<defrec_patch_prediction>("align: predictions", in, 3, patches),
        take<defrec_patch_observation>("align: observations", out[0], patches),
        take_optional<defrec_patch_prediction>("align: predictions out", out, 1, patches)};
    if (buffers.gray == nullptr)
        throw StageError(DEFREC_ERROR_ARGUMENT, "align: no live image given");
    if (buffers.motions == nullptr && buffers.given == nullptr && patches > 0)
        throw StageError(DEFREC_ERROR_ARGUMENT, "align: neither motions nor predictions given");
    return buffers;
}

}  // namespace defrec
