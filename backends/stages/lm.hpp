// Contract of stage lm: constants, buffers and checks, once for all backends. docs/stages/lm.md.
// Shaders include this file as well, for the part outside __cplusplus.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/lm_constants.h"
#include "backends/stages/surface.hpp"
#ifdef __cplusplus
#include "backends/shared/lm_arap.hpp"

namespace defrec {
#endif

// The parameters as the terms of the cost take them.
struct LmConstants {
    FloatCamera camera;
    uint nodes, points, landmarks, patches;
    float icp_weight, match_weight, patch_weight;
    float icp_tukey, match_tukey, patch_tukey;  // mm, mm, px
    float association, match_slope;             // mm; 1 / (5 H)
    float length_weight, angle_weight,
        rotation_weight;  // the last two times the squared node spacing
    float spacing2, damping;
};

#ifdef __cplusplus
constexpr LmConstants constants_of(const defrec_lm_params& p) {
    const float spacing2 = p.node_spacing_mm * p.node_spacing_mm;
    return {.camera = float_camera(p.camera),
            .nodes = p.nodes,
            .points = p.points,
            .landmarks = p.landmarks,
            .patches = p.patches,
            .icp_weight = p.icp_weight,
            .match_weight = p.match_weight,
            .patch_weight = p.patch_weight,
            .icp_tukey = p.icp_tukey_mm,
            .match_tukey = p.match_tukey_mm,
            .patch_tukey = p.patch_tukey_px,
            .association = p.association_mm,
            .match_slope = 1 / (5 * p.match_threshold_mm),
            .length_weight = p.length_weight,
            .angle_weight = p.angle_weight * spacing2,
            .rotation_weight = p.rotation_weight * spacing2,
            .spacing2 = spacing2,
            .damping = p.damping};
}

// Steps of the conjugate gradients in one iteration; 0: every control point by itself.
constexpr uint32_t gradient_steps(const defrec_lm_params& params) {
    return params.solver == DEFREC_SOLVER_INDEPENDENT ? 0 : params.cg_iterations;
}

struct LmTemplateBuffers {
    static constexpr const char* kName = "lm prepare";
    const float* nodes;  // x y z of each control point
    const defrec_edge* edges;
    const defrec_surface_point *points, *landmarks;
    const defrec_patch* patches;

    template <class List>
    void list(List& list, const defrec_lm_params& params) {
        list.input("control points", nodes, uint64_t{params.nodes} * 3);
        list.input("edges", edges, params.edges);
        list.input("points", points, params.points);
        list.input("landmarks", landmarks, params.landmarks);
        list.input("patches", patches, params.patches);
    }
};
// Throws where something cannot be used: an index out of range, a number that is not finite, an
// edge of length 0.
inline LmTemplateBuffers read_template(const defrec_lm_params& params,
                                       std::span<const InBuffer> in) {
    const auto given = view_buffers<LmTemplateBuffers>(params, in);
    const auto refuse = [](const std::string& text) {
        throw StageError(DEFREC_ERROR_ARGUMENT, "lm: " + text);
    };
    if (!all_finite(given.nodes, size_t(params.nodes) * 3))
        refuse("a control point's position is not finite");
    check_blended("lm: point", given.points, params.points, params.nodes);
    check_blended("lm: landmark", given.landmarks, params.landmarks, params.nodes);
    check_blended("lm: patch", given.patches, params.patches, params.nodes);
    for (size_t i = 0; i < params.points; ++i)
        if (!all_finite(given.points[i].normal, 3))
            refuse("the normal of point " + std::to_string(i) + " is not finite");
    for (size_t i = 0; i < params.edges; ++i) {
        const defrec_edge& edge = given.edges[i];
        const bool known = edge.a >= 0 && edge.b >= 0 && uint32_t(edge.a) < params.nodes &&
                           uint32_t(edge.b) < params.nodes;
        const auto node = [&](int32_t index) {
            return load3<double>(given.nodes + 3 * size_t(index));
        };
        const Vec3<double> along = known ? node(edge.b) - node(edge.a) : Vec3<double>{};
        if (!(dot(along, along) > kMinLengthMm * kMinLengthMm) || !(edge.weight > 0) ||
            !std::isfinite(edge.weight))
            refuse("edge " + std::to_string(i) +
                   " has no length, no weight, or a control point outside 0.." +
                   std::to_string(params.nodes) + " (exclusive)");
    }
    return given;
}

struct LmBuffers {
    static constexpr const char* kName = "lm";
    const defrec_motion* motions;
    const defrec_match* matches;                   // nullptr: none
    const defrec_patch_observation* observations;  // nullptr: none
    const int16_t* disparity;                      // nullptr: none
    defrec_motion* results;
    defrec_lm_summary* summary;

    template <class List>
    void list(List& list, const defrec_lm_params& params) {
        list.input("motions", motions, params.nodes);
        list.optional_input("matches", matches, params.landmarks);
        list.optional_input("patch observations", observations, params.patches);
        list.optional_input("disparity", disparity, disparity_elements(params));
        list.output("motions out", results, params.nodes);
        list.output("summary", summary, 1);
    }
};
inline BufferTable buffer_table(const defrec_lm_params& params) {
    return table_of<LmBuffers>(params);
}

}  // namespace defrec
#endif
