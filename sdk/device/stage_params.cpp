// See stage_params.hpp.
#include "sdk/device/stage_params.hpp"

#include "sdk/base/check_ranges.hpp"
#include "sdk/base/error.hpp"
#include "sdk/base/struct_size.hpp"
#include "sdk/device/device.hpp"

namespace defrec {
namespace {

template <class Params>
StageParams::Any read(const void* given) {
    Params params = read_struct<Params>("params", given);
    fill_defaults(params);
    check_ranges(params);
    return params;
}

StageParams::Any read_any(uint32_t stage, const void* given) {
    switch (stage) {
        case DEFREC_STAGE_RECTIFY:
            return read<defrec_rectify_params>(given);
        case DEFREC_STAGE_STEREO:
            return read<defrec_stereo_params>(given);
        case DEFREC_STAGE_ORB:
            return read<defrec_orb_params>(given);
        case DEFREC_STAGE_MATCH:
            return read<defrec_match_params>(given);
        case DEFREC_STAGE_ALIGN:
            return read<defrec_align_params>(given);
        case DEFREC_STAGE_RANSAC:
            return read<defrec_ransac_params>(given);
        case DEFREC_STAGE_LM:
            return read<defrec_lm_params>(given);
        case DEFREC_STAGE_WARP:
            return read<defrec_warp_params>(given);
        default:
            fail(DEFREC_ERROR_ARGUMENT, "unknown stage ", stage, ", 0 to ",
                 DEFREC_STAGE_COUNT_V1 - 1, " expected");
    }
}

// ---- sizes of buffers, docs/stages.md ---------------------------------------

uint64_t bytes_of_image(uint64_t stride, uint64_t width, uint64_t height, uint64_t element = 1) {
    return (stride * (height - 1) + width) * element;
}
uint64_t pick(size_t index, std::initializer_list<uint64_t> sizes) {
    return index < sizes.size() ? sizes.begin()[index] : 0;
}

template <class Params>
uint64_t disparity_bytes(const Params& p) {
    return bytes_of_image(p.stride, p.width, p.height, sizeof(int16_t));
}
template <class Params>
uint64_t gray_bytes(const Params& p) {
    return bytes_of_image(p.stride, p.width, p.height);
}

uint64_t in_bytes(const defrec_rectify_params& p, size_t i) {
    const uint64_t pixel = bytes_per_pixel(p.format);
    return pick(i, {bytes_of_image(p.source_stride, p.source_width * pixel, p.source_height),
                    uint64_t{8} * p.width * p.height, uint64_t{p.source_width} * p.source_height});
}
uint64_t in_bytes(const defrec_stereo_params& p, size_t i) {
    const uint64_t gray = gray_bytes(p);
    return pick(i, {gray, gray, gray, gray});
}
uint64_t in_bytes(const defrec_orb_params& p, size_t i) {
    return pick(i, {gray_bytes(p), gray_bytes(p)});
}
uint64_t in_bytes(const defrec_match_params& p, size_t i) {
    return pick(i, {sizeof(uint32_t), 0, disparity_bytes(p)});
}
uint64_t in_bytes(const defrec_align_params& p, size_t i) {
    return pick(i, {gray_bytes(p), gray_bytes(p), uint64_t{p.nodes} * sizeof(defrec_motion), 0});
}
uint64_t in_bytes(const defrec_ransac_params&, size_t) { return 0; }
uint64_t in_bytes(const defrec_lm_params& p, size_t i) {
    return pick(
        i, {uint64_t{p.nodes} * sizeof(defrec_motion), uint64_t{p.landmarks} * sizeof(defrec_match),
            uint64_t{p.patches} * sizeof(defrec_patch_observation), disparity_bytes(p)});
}
uint64_t in_bytes(const defrec_warp_params& p, size_t i) {
    return pick(i, {uint64_t{p.nodes} * sizeof(defrec_motion), disparity_bytes(p)});
}

uint64_t out_bytes(const defrec_rectify_params& p, size_t i) {
    return pick(i, {gray_bytes(p), gray_bytes(p)});
}
uint64_t out_bytes(const defrec_stereo_params& p, size_t i) {
    return pick(i, {disparity_bytes(p), gray_bytes(p)});
}
uint64_t out_bytes(const defrec_orb_params& p, size_t i) {
    return pick(i, {sizeof(uint32_t), uint64_t{p.capacity} * sizeof(defrec_feature)});
}
uint64_t out_bytes(const defrec_match_params&, size_t) { return 0; }
uint64_t out_bytes(const defrec_align_params&, size_t) { return 0; }
uint64_t out_bytes(const defrec_ransac_params&, size_t i) {
    return pick(i, {0, sizeof(defrec_ransac_summary)});
}
uint64_t out_bytes(const defrec_lm_params& p, size_t i) {
    return pick(i, {uint64_t{p.nodes} * sizeof(defrec_motion), sizeof(defrec_lm_summary)});
}
uint64_t out_bytes(const defrec_warp_params& p, size_t i) {
    return pick(i, {uint64_t{p.points} * sizeof(defrec_surface_sample)});
}

}  // namespace

StageParams::StageParams(uint32_t stage, const void* given)
    : stage_(stage), params_(read_any(stage, given)) {}

const void* StageParams::get() const {
    return std::visit([](const auto& params) -> const void* { return &params; }, params_);
}
uint64_t StageParams::input_bytes(size_t index) const {
    return std::visit([index](const auto& params) { return in_bytes(params, index); }, params_);
}
uint64_t StageParams::output_bytes(size_t index) const {
    return std::visit([index](const auto& params) { return out_bytes(params, index); }, params_);
}

}  // namespace defrec
