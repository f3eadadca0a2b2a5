// Jobs of the stages that follow a template: match, align, ransac, lm, warp.
#pragma once
#include "backends/shared/test_surface.hpp"
#include "conformance/scenes/jobs.hpp"

namespace defrec::conformance {

// Landmarks and features of which most are copies of each other with some bits flipped, over a
// smooth disparity image with holes.
struct MatchScene {
    defrec_match_params params{};
    std::vector<defrec_landmark> landmarks;
    uint32_t count = 0;  // of features, as the stage is told
    std::vector<defrec_feature> features;
    std::vector<int16_t> disparity;  // without gaps
};
MatchScene match_scene(uint64_t seed, uint32_t landmarks, uint32_t features, uint32_t width = 96,
                       uint32_t height = 72);
StageJob match_job(const MatchScene& scene);

// A texture in a view and, turned, stretched and moved, in the live image; patches on a plane at 80
// mm, whose one control point's motion moves them the same way.
struct AlignOptions {
    uint32_t width = 128, height = 96, patches = 40, views = 1;
    double angle = 0.05, scale = 1.04, noise = 1, prediction_error = 1.5;  // px
};
struct AlignScene {
    defrec_align_params params{};
    Gray live, mask;
    std::vector<Gray> views;
    std::vector<defrec_patch> patches;
    std::vector<defrec_patch_slope> slopes;  // empty: not given
    std::vector<defrec_motion> motions;
    std::vector<defrec_patch_prediction> predictions;
};
// params: what is not of the scene; sizes, counts and camera are filled in.
AlignScene align_scene(const defrec_align_params& params, uint64_t seed,
                       const AlignOptions& options = {});
enum AlignGiven {
    align_motions = 1,
    align_predictions = 2,
    align_mask = 4,
    align_no_prediction_output = 8
};
StageJob align_job(const AlignScene& scene, int given);

// Matches of a bent surface, turned and moved, of which the share `outliers` lands elsewhere on it.
struct RansacScene {
    defrec_ransac_params params{};
    std::vector<defrec_landmark> landmarks;
    std::vector<defrec_match> matches;
};
RansacScene ransac_scene(uint64_t seed, uint32_t count, double outliers, double degrees);
StageJob ransac_job(const RansacScene& scene);

// A wavy surface that has deformed, as backends' tests see it.
test::TestSurface test_surface(uint64_t seed, uint32_t width = 144, uint32_t height = 96);
// The same disparities in views that converge: where one is left, it is smaller by the offset.
void converge(defrec_camera& camera, std::vector<int16_t>& disparity, double offset_px);
// Motions of the control points near the surface's deformation: each turned and moved a little on
// its own.
std::vector<defrec_motion> loose_motions(const test::TestSurface& surface, uint64_t seed,
                                         double turn = 0.05, double step_mm = 0.8);

// The same motions, by factors from 1e-30 to 1e30.
void scale_motions(std::vector<defrec_motion>& motions);

enum LmGiven { lm_matches = 1, lm_patches = 2, lm_depth = 4, lm_everything = 7 };
// params: what is not of the surface.
StageJob lm_job(const test::TestSurface& surface, defrec_lm_params params,
                const std::vector<defrec_motion>& start, int given = lm_everything);
StageJob warp_job(const test::TestSurface& surface, defrec_warp_params params,
                  const std::vector<defrec_motion>& motions, bool depth = true);

}  // namespace defrec::conformance
