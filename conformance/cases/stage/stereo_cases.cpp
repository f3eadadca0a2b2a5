// Stage stereo: exact in every sub-stage.
#include "conformance/cases/stage/stage_case.hpp"
#include "conformance/scenes/jobs.hpp"

namespace defrec::conformance {
namespace {

using Params = defrec_stereo_params;

Params base(uint32_t width = 128, uint32_t height = 80) {
    Params params = blank<Params>();
    params.width = width;
    params.height = height;
    params.disparities = 32;
    return params;
}

enum Given { nothing = 0, left_mask = 1, right_mask = 2, both_masks = 3 };

struct Options {
    int masks = both_masks;
    bool extras = true, smoke = true, slow = false;
    double disparity = 12;
};

void add(std::vector<StageCase>& cases, const char* name, const char* title, const Params& params,
         const Options& o) {
    const auto make = [params, o](CaseRun&, uint32_t frame) {
        const StereoPair pair = stereo_pair(params.width, params.height, 40 + frame, o.disparity);
        return stereo_job(params, pair.left, pair.right,
                          (o.masks & left_mask) != 0 ? &pair.left_mask : nullptr,
                          (o.masks & right_mask) != 0 ? &pair.right_mask : nullptr, o.extras);
    };
    cases.push_back(
        {DEFREC_STAGE_STEREO, name, title, make, compare_all_exactly, o.smoke, o.slow, {}});
}

void add_pictures(std::vector<StageCase>& cases, const char* name, const char* title,
                  const std::function<Gray(uint64_t)>& picture, bool same = false) {
    const auto make = [picture, same](CaseRun&, uint32_t frame) {
        if (frame == 1) {
            const StereoPair pair = stereo_pair(96, 64, 5, 12);
            return stereo_job(base(96, 64), pair.left, pair.right, nullptr, nullptr);
        }
        return stereo_job(base(96, 64), picture(1), picture(same ? 1 : 2), nullptr, nullptr);
    };
    cases.push_back({DEFREC_STAGE_STEREO, name, title, make, compare_all_exactly, true, false, {}});
}

void add_inputs(std::vector<StageCase>& cases) {
    add(cases, "both_masks", "A wavy surface with a nearer strip and highlights, with both masks.",
        base(), {});
    add(cases, "no_masks", "Without masks every pixel is usable.", base(), {.masks = nothing});
    add(cases, "left_mask", "With the left mask alone.", base(97, 71), {.masks = left_mask});
    add(cases, "right_mask", "With the right mask alone.", base(97, 71), {.masks = right_mask});
    add(cases, "disparity_alone", "The result is the same if nothing else is asked for.",
        base(97, 71), {.extras = false});
    add_pictures(cases, "flat", "Images without texture have no disparity.",
                 [](uint64_t) { return flat_picture(96, 64, 90); });
    add_pictures(cases, "black", "Black images after others have no disparity.",
                 [](uint64_t) { return flat_picture(96, 64, 0); });
    add_pictures(cases, "white", "White images after others have no disparity.",
                 [](uint64_t) { return flat_picture(96, 64, 255); });
    add_pictures(cases, "noise", "Two images of nothing but noise.",
                 [](uint64_t seed) { return random_picture(96, 64, seed); });
    add_pictures(
        cases, "same_image", "Twice the same image: disparity 0.",
        [](uint64_t seed) { return texture_picture(96, 64, seed); }, true);
    add_pictures(
        cases, "extremes", "Images of black and white alone.",
        [](uint64_t seed) {
            Gray picture = texture_picture(96, 64, seed);
            for (uint8_t& pixel : picture.pixels) pixel = pixel > 120 ? 255 : 0;
            return picture;
        },
        true);
    const auto all_masked = [](CaseRun&, uint32_t frame) {
        const StereoPair pair = stereo_pair(96, 64, 8 + frame);
        const Gray none = flat_picture(96, 64, frame == 0 ? 0 : 1);
        return stereo_job(base(96, 64), pair.left, pair.right, &none, &pair.right_mask);
    };
    cases.push_back({DEFREC_STAGE_STEREO,
                     "all_masked",
                     "A left image of which nothing is usable.",
                     all_masked,
                     compare_all_exactly,
                     true,
                     false,
                     {}});
}

void add_sizes(std::vector<StageCase>& cases) {
    Params params = base(97, 71);
    params.stride = 112;
    add(cases, "padded_stride", "Bytes between rows are neither read nor written.", params, {});
    params.stride = 99;
    add(cases, "odd_stride", "An odd size with rows that begin at odd places.", params, {});
    add(cases, "smallest", "The smallest image: 2 x 2.", base(2, 2), {});
    add(cases, "smaller_than_window", "An image smaller than the windows.", base(13, 11),
        {.disparity = 2});
    add(cases, "one_window_high", "Rows that just hold a window.", base(120, 19), {});
    add(cases, "widest", "Rows as long as can be.", base(DEFREC_MAX_SIDE, 24),
        {.smoke = false, .slow = true});
    add(cases, "highest", "Columns as long as can be.", base(48, DEFREC_MAX_SIDE),
        {.smoke = false, .slow = true});
    add(cases, "camera_size", "An image of 640 x 480 with 128 disparities.",
        [] {
            Params p = base(640, 480);
            p.disparities = 128;
            return p;
        }(),
        {.smoke = false, .slow = true, .disparity = 40});
}

void add_search(std::vector<StageCase>& cases) {
    Params params = base();
    params.min_disparity = 7;
    params.disparities = 17;
    add(cases, "min_disparity", "Searching from an odd disparity on.", params, {});
    params.min_disparity = 0;
    params.disparities = 1;
    add(cases, "one_disparity", "Searching a single disparity.", params, {.disparity = 1});
    params = base(96, 40);
    params.disparities = 510;
    add(cases, "most_disparities", "Searching more disparities than the image has columns.", params,
        {.smoke = false});
    params = base();
    params.min_disparity = 1024;
    add(cases, "far_min_disparity", "Searching beyond the image: nothing is found.", params, {});
}

void add_parameters(std::vector<StageCase>& cases) {
    Params params = base();
    params.radius = params.refine_radius = 2;
    params.texture = 40;
    add(cases, "small_windows", "The smallest windows, and more texture asked for.", params, {});
    params = base();
    params.radius = params.refine_radius = 6;
    params.fill_radius = 8;
    add(cases, "large_windows", "The largest windows, and large holes filled.", params, {});
    params = base();
    params.min_score = 3000;
    params.refine_score = 3600;
    params.uniqueness = 300;
    params.support = 22;
    params.edge = 8;
    add(cases, "strict", "Strict checks of score, uniqueness, support and edges.", params, {});
    params = base();
    params.min_score = 1;
    params.refine_score = 1;
    params.uniqueness = 1;
    params.support = 1;
    params.left_right = 9;
    params.texture = 1;
    params.edge = 4096;
    add(cases, "loose", "Checks that let everything pass.", params, {});
    params = base();
    params.smooth_radius = 1;
    params.smooth_range = 256;
    params.smooth_passes = 8;
    params.fill_radius = 1;
    add(cases, "smoothing", "Other smoothing: radius 1, range 256, 8 passes.", params, {});
}

}  // namespace

void add_stereo_cases(std::vector<StageCase>& cases) {
    add_inputs(cases);
    add_sizes(cases);
    add_search(cases);
    add_parameters(cases);
}

}  // namespace defrec::conformance
