// Stage orb: exact in every sub-stage.
#include "conformance/cases/stage/stage_case.hpp"
#include "conformance/scenes/jobs.hpp"

namespace defrec::conformance {
namespace {

using Params = defrec_orb_params;
using Expects = std::function<void(const Expected&)>;

Params base(uint32_t width = 160, uint32_t height = 120) {
    Params params = blank<Params>();
    params.width = width;
    params.height = height;
    params.capacity = 256;
    return params;
}

void compare(CaseRun& run, const StageJob& job, const Expected& expected,
             const std::vector<Bytes>& found) {
    for (size_t i = 0; i < job.out.size(); ++i)
        if (job.out[i].given)
            compare_exactly(run, job, i, expected, found, i == 1 ? kFeatureFields : Fields{});
}

uint32_t number(const Expected& expected) { return as<uint32_t>(expected.outputs[0])[0]; }
Expects at_least(uint32_t minimum) {
    return [minimum](const Expected& expected) {
        require(number(expected) >= minimum, "the reference finds ", number(expected),
                " features, the case is about ", minimum, " or more");
    };
}
Expects none() {
    return [](const Expected& expected) {
        require(number(expected) == 0, "the reference finds features, the case is about none");
    };
}

using MakePicture = std::function<Gray(uint64_t seed)>;

struct Options {
    bool mask = false, extras = true, smoke = true, slow = false;
};

void add(std::vector<StageCase>& cases, const char* name, const char* title, const Params& params,
         const MakePicture& picture, const Expects& expects, const Options& o = {}) {
    const auto make = [=](CaseRun&, uint32_t frame) {
        const Gray gray =
            frame == 0 ? picture(60) : texture_picture(params.width, params.height, 61);
        const Gray mask = holes_mask(params.width, params.height, 62 + frame, 8, 24);
        return orb_job(params, gray, o.mask ? &mask : nullptr, o.extras);
    };
    cases.push_back({DEFREC_STAGE_ORB, name, title, make, compare, o.smoke, o.slow, expects});
}

MakePicture texture(const Params& params) {
    return [params](uint64_t seed) { return texture_picture(params.width, params.height, seed); };
}
MakePicture noise(const Params& params) {
    return [params](uint64_t seed) { return random_picture(params.width, params.height, seed); };
}

void add_inputs(std::vector<StageCase>& cases) {
    const Params params = base();
    add(cases, "texture", "Features of a tissue-like image.", params, texture(params),
        at_least(40));
    add(cases, "mask", "No feature looks at a masked pixel.", params, texture(params), at_least(20),
        {.mask = true});
    add(cases, "features_alone", "The result is the same if no sub-stage is asked for.", params,
        texture(params), at_least(20), {.mask = true, .extras = false});
    add(cases, "noise", "Features of nothing but noise.", params, noise(params), at_least(40));
    add(
        cases, "flat", "A flat image after another has no features.", params,
        [](uint64_t) { return flat_picture(160, 120, 77); }, none());
    add(
        cases, "white", "A saturated image after another has no features.", params,
        [](uint64_t) { return flat_picture(160, 120, 255); }, none());
    add(
        cases, "extremes", "Black and white alone: the largest scores, and many ties.", params,
        [](uint64_t seed) {
            Gray picture = texture_picture(160, 120, seed);
            for (uint8_t& pixel : picture.pixels) pixel = pixel > 120 ? 255 : 0;
            return picture;
        },
        at_least(20));
    add(
        cases, "few_dots", "Few equal corners far apart: distances at their limit, ties by place.",
        base(200, 160),
        [](uint64_t seed) {
            Gray picture = flat_picture(200, 160, 40);
            Random random(seed);
            for (int dot = 0; dot < 14; ++dot) {
                const uint32_t x0 = 20 + random.below(150), y0 = 20 + random.below(110);
                for (uint32_t y = y0; y < y0 + 4; ++y)
                    for (uint32_t x = x0; x < x0 + 4; ++x) picture.at(x, y) = 140;
            }
            return picture;
        },
        at_least(5));
    const auto all_masked = [](CaseRun&, uint32_t frame) {
        const Gray mask = flat_picture(160, 120, frame == 0 ? 0 : 1);
        return orb_job(base(), texture_picture(160, 120, 63 + frame), &mask);
    };
    cases.push_back({DEFREC_STAGE_ORB, "all_masked",
                     "An image of which nothing is usable has no features.", all_masked, compare,
                     true, false, none()});
}

void add_sizes(std::vector<StageCase>& cases) {
    Params params = base(131, 97);
    params.stride = 160;
    add(cases, "padded_stride", "Bytes between rows are not looked at.", params, texture(params),
        at_least(20), {.mask = true});
    params.stride = 133;
    add(cases, "odd_stride", "An odd size with rows that begin at odd places.", params,
        texture(params), at_least(20), {.mask = true});
    params = base(DEFREC_MIN_WIDTH, DEFREC_MIN_HEIGHT);
    params.levels = 8;
    add(cases, "smallest", "The smallest image, most of its levels without a cell.", params,
        texture(params), {}, {.mask = true});
    params = base(DEFREC_MAX_SIDE, DEFREC_MIN_HEIGHT);
    add(cases, "widest", "Rows as long as can be.", params, texture(params), at_least(100),
        {.smoke = false, .slow = true});
    params = base(DEFREC_MIN_WIDTH, DEFREC_MAX_SIDE);
    add(cases, "highest", "Columns as long as can be.", params, texture(params), at_least(100),
        {.smoke = false, .slow = true});
    params = base(640, 480);
    params.capacity = 2048;
    add(cases, "camera_size", "An image of 640 x 480.", params, texture(params), at_least(300),
        {.mask = true, .smoke = false, .slow = true});
}

void add_parameters(std::vector<StageCase>& cases) {
    Params params = base();
    params.capacity = 30;
    add(cases, "capacity_overflow", "More corners than the capacity: the spacing grows.", params,
        texture(params), at_least(10));
    params.capacity = 1;
    add(cases, "capacity_one", "Room for one feature.", params, noise(params), {});
    params.capacity = 65535;
    params.spacing = 1;
    params.cell = 4;
    params.threshold = 1;
    add(cases, "capacity_most", "Room for all: the smallest cells, spacing and threshold.", params,
        noise(params), at_least(200));
    params = base();
    params.levels = 8;
    params.cell = 16;
    add(cases, "eight_levels", "Eight levels with cells of 16 px, some levels too small for any.",
        params, texture(params), at_least(10), {.mask = true});
    params.levels = 1;
    params.cell = 7;
    params.spacing = 63;
    add(cases, "one_level", "One level, cells that do not fit evenly, the largest spacing.", params,
        texture(params), {});
    params = base();
    params.threshold = 60;
    add(cases, "high_threshold", "Only strong corners.", params, noise(params), at_least(10));
    params.threshold = 254;
    add(cases, "highest_threshold", "A threshold that nothing exceeds.", params, noise(params),
        none());
}

void add_halvings(std::vector<StageCase>& cases) {
    Params params = base(323, 243);
    params.stride = 325;
    params.halvings = 1;
    add(cases, "halved", "An image halved before the pyramid, with its mask, an odd size.", params,
        texture(params), at_least(20), {.mask = true});
    add(cases, "halved_alone", "The same without sub-stages.", params, texture(params),
        at_least(20), {.mask = true, .extras = false});
    params = base(643, 487);
    params.levels = 3;
    params.halvings = 2;
    add(cases, "halved_twice", "Each halving rounds by itself.", params, noise(params),
        at_least(20), {.mask = true});
    params.halvings = 3;
    add(cases, "halved_thrice", "The most halvings.", params, noise(params), at_least(10));
    params = base(DEFREC_MIN_WIDTH, DEFREC_MIN_HEIGHT);
    params.levels = 8;
    params.halvings = 3;
    add(cases, "halved_smallest", "The smallest image halved: no cell at all, levels of no pixel.",
        params, texture(params), none(), {.mask = true});
}

}  // namespace

void add_orb_cases(std::vector<StageCase>& cases) {
    add_inputs(cases);
    add_sizes(cases);
    add_parameters(cases);
    add_halvings(cases);
}

}  // namespace defrec::conformance
