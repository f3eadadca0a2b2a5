// Contract of stage stereo: constants, buffers and checks, once for all backends.
// docs/stages/stereo.md. Shaders include this file as well, for the part outside __cplusplus.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/stereo_constants.h"
#ifdef __cplusplus
#include "backends/stages/contract.hpp"

namespace defrec {
#endif

// What follows from the parameters. Sizes in px; half: of half resolution.
struct StereoConstants {
    int width, height, stride;  // of the caller's images; stride: elements
    int half_width, half_height;
    int samples_x, samples_y, half_samples_x, half_samples_y;
    int first, count;  // disparities searched at half resolution: first .. first + count - 1
    int radius, refine_radius;  // of the windows of search and refinement
    float one_over_n;           // n: pixels in a window of the search
    float min_score, min_lead;  // of the search's best, and over its second; 1 / n of the
                                // correlation coefficient
    int min_variance;  // of a window of the search with texture: the smallest V with 256 V >=
                       // texture^2 n^2
    int left_right, support, edge;  // as in the parameters from here on
    int texture, refine_score;
    int fill_radius, smooth_radius;  // in samples
    int smooth_range, smooth_passes;
#ifdef __cplusplus
    constexpr size_t pixels() const { return size_t(width) * size_t(height); }
    constexpr size_t samples() const { return size_t(samples_x) * size_t(samples_y); }
    constexpr size_t half_samples() const {
        return size_t(half_samples_x) * size_t(half_samples_y);
    }
    constexpr size_t right_winners() const { return size_t(half_width) * size_t(half_samples_y); }
#endif
};

#ifdef __cplusplus
inline StereoConstants constants_of(const defrec_stereo_params& p) {
    const int first = p.min_disparity / 2, last = (p.min_disparity + int(p.disparities) - 1) / 2;
    const uint64_t side = 2 * uint64_t{p.radius} + 1, n = side * side, deviation = p.texture * n;
    const float unit = 1.0f / float(kScoreOne) / float(n);  // of scores
    return {.width = int(p.width),
            .height = int(p.height),
            .stride = int(p.stride),
            .half_width = int(p.width / 2),
            .half_height = int(p.height / 2),
            .samples_x = int((p.width + 1) / 2),
            .samples_y = int((p.height + 1) / 2),
            .half_samples_x = int((p.width / 2 + 1) / 2),
            .half_samples_y = int((p.height / 2 + 1) / 2),
            .first = first,
            .count = last - first + 1,
            .radius = int(p.radius),
            .refine_radius = int(p.refine_radius),
            .one_over_n = 1.0f / float(n),
            .min_score = float(p.min_score) * unit,
            .min_lead = float(p.uniqueness) * unit,
            .min_variance = int((deviation * deviation + kTextureOne2 - 1) / kTextureOne2),
            .left_right = int(std::min(p.left_right, kMaxIndex)),
            .support = int(p.support),
            .edge = int(p.edge),
            .texture = int(p.texture),
            .refine_score = int(p.refine_score),
            .fill_radius = int((p.fill_radius + 1) / 2),
            .smooth_radius = int((p.smooth_radius + 1) / 2),
            .smooth_range = int(p.smooth_range),
            .smooth_passes = int(p.smooth_passes)};
}

struct StereoBuffers {
    static constexpr const char* kName = "stereo";
    const uint8_t *left, *right, *left_mask, *right_mask;  // the masks may be nullptr
    int16_t* disparity;                                    // stride elements from row to row
    uint8_t* confidence;                                   // the same; may be nullptr
    // The results of the sub-stages, without gaps between rows; may be nullptr.
    uint8_t *prepared_left, *prepared_right;
    int32_t *left_keys, *right_keys;
    int16_t *checked, *supported, *dense, *half_refined, *hypothesis, *refined, *score, *evidence,
        *filled;

    template <class List>
    void list(List& list, const StereoConstants& c) {
        const uint64_t image =
            image_elements(uint64_t(c.width), uint64_t(c.height), uint64_t(c.stride));
        const uint64_t full = c.pixels(), samples = c.samples(), half_samples = c.half_samples();
        list.input("left", left, image);
        list.input("right", right, image);
        list.optional_input("left mask", left_mask, image);
        list.optional_input("right mask", right_mask, image);
        list.output("disparity", disparity, image);
        list.optional_output("confidence", confidence, image);
        list.optional_output("prepared left", prepared_left, full);
        list.optional_output("prepared right", prepared_right, full);
        list.optional_output("left keys", left_keys, half_samples);
        list.optional_output("right keys", right_keys, c.right_winners());
        list.optional_output("checked", checked, half_samples);
        list.optional_output("supported", supported, half_samples);
        list.optional_output("dense", dense, half_samples);
        list.optional_output("half refined", half_refined, half_samples);
        list.optional_output("hypothesis", hypothesis, full);
        list.optional_output("refined", refined, samples);
        list.optional_output("score", score, samples);
        list.optional_output("evidence", evidence, samples);
        list.optional_output("filled", filled, samples);
    }
};
inline BufferTable buffer_table(const defrec_stereo_params& params) {
    return table_of<StereoBuffers>(constants_of(params));
}

}  // namespace defrec
#endif
