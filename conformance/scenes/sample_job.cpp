// See sample_job.hpp.
#include "conformance/scenes/sample_job.hpp"

#include "conformance/scenes/template_jobs.hpp"

namespace defrec::conformance {
namespace {

StageJob sample_rectify(uint64_t seed) {
    auto params = blank<defrec_rectify_params>();
    params.format = DEFREC_FORMAT_BGR8;
    params.source_width = 64;
    params.source_height = 48;
    const std::vector<int32_t> map = bent_map(params, seed);
    Gray ignore = holes_mask(64, 48, seed, 3, 9);
    for (uint8_t& pixel : ignore.pixels) pixel = uint8_t(255 - pixel);  // nonzero is not tissue
    return rectify_job(params, texture_picture(64, 48, seed), &map, &ignore);
}

StageJob sample_stereo(uint64_t seed) {
    auto params = blank<defrec_stereo_params>();
    params.width = 64;
    params.height = 48;
    params.disparities = 24;
    const StereoPair pair = stereo_pair(64, 48, seed, 8);
    return stereo_job(params, pair.left, pair.right, &pair.left_mask, &pair.right_mask);
}

StageJob sample_orb(uint64_t seed) {
    auto params = blank<defrec_orb_params>();
    params.width = 80;
    params.height = 64;
    params.capacity = 64;
    const Gray mask = holes_mask(80, 64, seed, 2, 9);
    return orb_job(params, texture_picture(80, 64, seed), &mask);
}

}  // namespace

StageJob sample_job(uint32_t stage, uint64_t seed) {
    switch (stage) {
        case DEFREC_STAGE_RECTIFY:
            return sample_rectify(seed);
        case DEFREC_STAGE_STEREO:
            return sample_stereo(seed);
        case DEFREC_STAGE_ORB:
            return sample_orb(seed);
        case DEFREC_STAGE_MATCH:
            return match_job(match_scene(seed, 40, 60));
        case DEFREC_STAGE_ALIGN:
            return align_job(
                align_scene(blank<defrec_align_params>(), seed, {.width = 80, .height = 64}),
                align_motions | align_mask);
        case DEFREC_STAGE_RANSAC:
            return ransac_job(ransac_scene(seed, 60, 0.3, 20));
        case DEFREC_STAGE_LM: {
            const test::TestSurface surface = test_surface(seed, 64, 48);
            auto params = blank<defrec_lm_params>();
            params.iterations = 3;
            return lm_job(surface, params, surface.rest());
        }
        case DEFREC_STAGE_WARP: {
            const test::TestSurface surface = test_surface(seed, 64, 48);
            return warp_job(surface, blank<defrec_warp_params>(),
                            loose_motions(surface, seed, 0.05, 2));
        }
        default:
            fail(DEFREC_ERROR_INTERNAL, "there is no stage ", stage);
    }
}

BufferCounts buffer_counts(uint32_t stage) {
    static constexpr BufferCounts kCounts[] = {{1, 3, 2, 2}, {2, 4, 1, 15}, {1, 2, 2, 7},
                                               {3, 3, 1, 1}, {1, 4, 1, 2},  {1, 1, 2, 2},
                                               {1, 4, 2, 2}, {1, 2, 1, 1}};
    return kCounts[stage];
}

}  // namespace defrec::conformance
