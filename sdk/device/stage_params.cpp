// See stage_params.hpp. Limits of one stage alone are the stage's own business: its creation
// refuses them.
#include "sdk/device/stage_params.hpp"

#include <cmath>

#include "backends/shared/stage_defaults_align.hpp"
#include "backends/shared/stage_defaults_lm.hpp"
#include "backends/shared/stage_defaults_match.hpp"
#include "backends/shared/stage_defaults_orb.hpp"
#include "backends/shared/stage_defaults_ransac.hpp"
#include "backends/shared/stage_defaults_rectify.hpp"
#include "backends/shared/stage_defaults_stereo.hpp"
#include "backends/shared/stage_defaults_warp.hpp"
#include "sdk/base/error.hpp"
#include "sdk/base/struct_size.hpp"
#include "sdk/device/device.hpp"

namespace defrec {
namespace {

constexpr uint32_t kMaxRecords = 1u << 22;
constexpr uint32_t kLongestStride = 1u << 20;

// One stage's checks, with its name in every error message.
class Checks {
  public:
    explicit Checks(uint32_t stage) : name_(stage_name(stage)) {}

    void image(uint32_t width, uint32_t height, uint32_t stride, uint32_t row) const {
        if (width == 0 || height == 0 || width > DEFREC_MAX_SIDE || height > DEFREC_MAX_SIDE)
            refuse("images of ", width, " x ", height, " given, 1 x 1 to ", int{DEFREC_MAX_SIDE},
                   " x ", int{DEFREC_MAX_SIDE}, " expected");
        if (stride < row || stride > kLongestStride)
            refuse("stride is ", stride, ", ", row, " to ", kLongestStride, " expected");
    }
    void count(const char* field, uint32_t value) const {
        if (value > kMaxRecords)
            refuse(field, " is ", value, ", at most ", kMaxRecords, " expected");
    }
    void camera(const defrec_camera& camera) const {
        const bool finite = std::isfinite(camera.cx) && std::isfinite(camera.cy) &&
                            std::isfinite(camera.fx) && std::isfinite(camera.fy) &&
                            std::isfinite(camera.baseline_mm);
        if (!finite || !(camera.fx > 0) || !(camera.fy > 0) || !(camera.baseline_mm > 0))
            refuse("camera: finite numbers, and focal lengths and a baseline > 0 expected");
    }
    void positive(const char* field, float value) const {
        if (!std::isfinite(value) || value < 0)
            refuse(field, " is ", value, ", a finite number of at least 0 expected");
    }
    template <class... Pieces>
    [[noreturn]] void refuse(const Pieces&... pieces) const {
        fail(DEFREC_ERROR_ARGUMENT, name_, ": ", pieces...);
    }

  private:
    const char* name_;
};

void check(const Checks& checks, const defrec_rectify_params& p) {
    if (bytes_per_pixel(p.format) == 0) checks.refuse("unknown format ", p.format);
    checks.image(p.source_width, p.source_height, p.source_stride,
                 p.source_width * bytes_per_pixel(p.format));
    checks.image(p.width, p.height, p.stride, p.width);
}
void check(const Checks& checks, const defrec_stereo_params& p) {
    checks.image(p.width, p.height, p.stride, p.width);
    if (p.min_disparity < 0 || p.min_disparity > DEFREC_MAX_SIDE || p.disparities > DEFREC_MAX_SIDE)
        checks.refuse("min_disparity ", p.min_disparity, " and ", p.disparities,
                      " disparities given, 0 to ", int{DEFREC_MAX_SIDE}, " expected");
}
void check(const Checks& checks, const defrec_orb_params& p) {
    checks.image(p.width, p.height, p.stride, p.width);
    checks.count("capacity", p.capacity);
}
void check(const Checks& checks, const defrec_match_params& p) {
    checks.image(p.width, p.height, p.stride, p.width);
    checks.count("landmarks", p.landmarks);
    checks.count("features", p.features);
    checks.camera(p.camera);
}
void check(const Checks& checks, const defrec_align_params& p) {
    checks.image(p.width, p.height, p.stride, p.width);
    checks.count("patches", p.patches);
    checks.count("nodes", p.nodes);
    if (p.views > 64) checks.refuse("views is ", p.views, ", at most 64 expected");
    checks.camera(p.camera);
}
void check(const Checks& checks, const defrec_ransac_params& p) {
    checks.count("landmarks", p.landmarks);
    checks.count("references", p.references);
    checks.count("iterations", p.iterations);
    checks.positive("threshold_mm", p.threshold_mm);
}
void check(const Checks& checks, const defrec_lm_params& p) {
    if (p.solver != DEFREC_SOLVER_COUPLED && p.solver != DEFREC_SOLVER_INDEPENDENT)
        checks.refuse("unknown solver ", p.solver);
    checks.image(p.width, p.height, p.stride, p.width);
    checks.count("nodes", p.nodes);
    checks.count("edges", p.edges);
    checks.count("points", p.points);
    checks.count("landmarks", p.landmarks);
    checks.count("patches", p.patches);
    checks.count("iterations", p.iterations);
    checks.count("cg_iterations", p.cg_iterations);
    checks.camera(p.camera);
    const std::pair<const char*, float> numbers[] = {{"node_spacing_mm", p.node_spacing_mm},
                                                     {"icp_weight", p.icp_weight},
                                                     {"match_weight", p.match_weight},
                                                     {"patch_weight", p.patch_weight},
                                                     {"arap_weight", p.arap_weight},
                                                     {"length_weight", p.length_weight},
                                                     {"angle_weight", p.angle_weight},
                                                     {"rotation_weight", p.rotation_weight},
                                                     {"icp_tukey_mm", p.icp_tukey_mm},
                                                     {"match_tukey_mm", p.match_tukey_mm},
                                                     {"patch_tukey_px", p.patch_tukey_px},
                                                     {"association_mm", p.association_mm},
                                                     {"damping", p.damping},
                                                     {"match_threshold_mm", p.match_threshold_mm}};
    for (const auto& [field, value] : numbers) checks.positive(field, value);
}
void check(const Checks& checks, const defrec_warp_params& p) {
    checks.image(p.width, p.height, p.stride, p.width);
    checks.count("nodes", p.nodes);
    checks.count("points", p.points);
    checks.camera(p.camera);
    checks.positive("tolerance_mm", p.tolerance_mm);
}

template <class Params>
StageParams::Any read(uint32_t stage, const void* given) {
    Params params = read_struct<Params>("params", given);
    fill_defaults(params);
    check(Checks(stage), params);
    return params;
}

StageParams::Any read_any(uint32_t stage, const void* given) {
    switch (stage) {
        case DEFREC_STAGE_RECTIFY:
            return read<defrec_rectify_params>(stage, given);
        case DEFREC_STAGE_STEREO:
            return read<defrec_stereo_params>(stage, given);
        case DEFREC_STAGE_ORB:
            return read<defrec_orb_params>(stage, given);
        case DEFREC_STAGE_MATCH:
            return read<defrec_match_params>(stage, given);
        case DEFREC_STAGE_ALIGN:
            return read<defrec_align_params>(stage, given);
        case DEFREC_STAGE_RANSAC:
            return read<defrec_ransac_params>(stage, given);
        case DEFREC_STAGE_LM:
            return read<defrec_lm_params>(stage, given);
        case DEFREC_STAGE_WARP:
            return read<defrec_warp_params>(stage, given);
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
