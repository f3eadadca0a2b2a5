// Stage rectify: exact.
#include "conformance/cases/stage/stage_case.hpp"
#include "conformance/scenes/jobs.hpp"

namespace defrec::conformance {
namespace {

using Params = defrec_rectify_params;

Params base(uint32_t width = 96, uint32_t height = 72, uint32_t format = DEFREC_FORMAT_GRAY8) {
    Params params = blank<Params>();
    params.format = format;
    params.source_width = width;
    params.source_height = height;
    return params;
}

// Bright enough here and there to be a highlight.
Gray bright_picture(uint32_t width, uint32_t height, uint64_t seed) {
    Gray picture = texture_picture(width, height, seed);
    for (uint8_t& pixel : picture.pixels) pixel = uint8_t(std::min(255, pixel * 3 / 2));
    return picture;
}

enum Given { nothing = 0, map = 1, ignore = 2 };

void add(std::vector<StageCase>& cases, const char* name, const char* title, const Params& params,
         int given, bool smoke = true, bool slow = false) {
    const auto make = [params, given](CaseRun&, uint32_t frame) {
        const Gray source = bright_picture(params.source_width, params.source_height, 10 + frame);
        const std::vector<int32_t> bent =
            (given & map) != 0 ? bent_map(params, 20 + frame) : std::vector<int32_t>();
        const Gray holes = holes_mask(params.source_width, params.source_height, 30 + frame, 12, 9);
        Gray tissue = holes;  // nonzero means ignored
        for (uint8_t& pixel : tissue.pixels) pixel = pixel == 0 ? uint8_t(1 + frame) : 0;
        return rectify_job(params, source, (given & map) != 0 ? &bent : nullptr,
                           (given & ignore) != 0 ? &tissue : nullptr);
    };
    cases.push_back(
        {DEFREC_STAGE_RECTIFY, name, title, make, compare_all_exactly, smoke, slow, {}});
}

void add_picture(std::vector<StageCase>& cases, const char* name, const char* title,
                 uint8_t value) {
    const auto make = [value](CaseRun&, uint32_t frame) {
        return rectify_job(base(),
                           frame == 0 ? flat_picture(96, 72, value) : bright_picture(96, 72, 3),
                           nullptr, nullptr);
    };
    cases.push_back(
        {DEFREC_STAGE_RECTIFY, name, title, make, compare_all_exactly, true, false, {}});
}

// A map whose entries lie on, just inside and just outside the source's borders, and at the ends of
// the integers.
StageJob border_job(CaseRun&, uint32_t frame) {
    Params params = base(40, 30);
    params.width = 64;
    params.height = 64;
    const int32_t across[] = {0,  -1,  1,   128 * 39,  128 * 39 + 1, 128 * 39 - 1,
                              64, 127, 128, INT32_MIN, INT32_MAX,    128 * 40};
    const int32_t down[] = {0,  -1,  1,   128 * 29,  128 * 29 + 1, 128 * 29 - 1,
                            64, 127, 128, INT32_MIN, INT32_MAX,    128 * 30};
    std::vector<int32_t> entries;
    Random random(frame + 1);
    for (int i = 0; i < 64 * 64; ++i) {
        entries.push_back(across[random.below(12)]);
        entries.push_back(down[random.below(12)]);
    }
    return rectify_job(params, bright_picture(40, 30, frame), &entries, nullptr);
}

void add_formats(std::vector<StageCase>& cases) {
    add(cases, "gray", "Gray pixels are taken as they are, and highlights masked.", base(),
        nothing);
    add(cases, "bgr", "BGR pixels become gray with the weights of the definition.",
        base(96, 72, DEFREC_FORMAT_BGR8), nothing);
    add(cases, "rgb_map", "RGB pixels are interpolated as the map says.",
        base(96, 72, DEFREC_FORMAT_RGB8), map);
    add(cases, "bgra_map_ignore", "BGRA pixels, a map and an ignore mask together.",
        base(96, 72, DEFREC_FORMAT_BGRA8), map | ignore);
    add(cases, "ignore", "Ignored pixels are masked where there is no map.", base(), ignore);
    add(cases, "map_ignore", "Ignored pixels mask what is interpolated from them.", base(),
        map | ignore);
}

void add_sizes(std::vector<StageCase>& cases) {
    Params params = base(97, 71, DEFREC_FORMAT_BGR8);
    params.source_stride = 97 * 3 + 11;
    params.stride = 113;
    add(cases, "padded_strides", "Bytes between rows are neither read nor written.", params,
        map | ignore);
    params = base(101, 67);
    params.width = 61;
    params.height = 93;
    add(cases, "other_size", "A result of another size than the source.", params, map | ignore);
    add(cases, "one_pixel", "The smallest image: one pixel.", base(1, 1, DEFREC_FORMAT_BGR8),
        nothing);
    add(cases, "one_pixel_map", "The smallest image through a map.", base(1, 1), map | ignore);
    add(cases, "one_row", "A single row.", base(53, 1), map | ignore);
    add(cases, "one_column", "A single column.", base(1, 47, DEFREC_FORMAT_RGB8), nothing);
    add(cases, "widest", "Rows as long as can be.", base(DEFREC_MAX_SIDE, 3, DEFREC_FORMAT_BGRA8),
        map, false);
    add(cases, "highest", "Columns as long as can be.",
        base(3, DEFREC_MAX_SIDE, DEFREC_FORMAT_BGR8), map, false);
    Params largest = base(DEFREC_MAX_SIDE, DEFREC_MAX_SIDE);
    largest.highlight_radius = 1;  // the reference looks at every pixel of every neighbourhood
    add(cases, "largest", "The largest image.", largest, nothing, false, true);
}

void add_parameters(std::vector<StageCase>& cases) {
    Params params = base();
    params.highlight_radius = 16;
    add(cases, "highlight_radius_16", "The largest radius round highlights.", params, nothing);
    params.highlight_radius = 1;
    params.saturation = 180;
    add(cases, "highlight_radius_1",
        "The smallest radius round highlights, and a lower saturation.", params, map);
    params = base();
    params.saturation = 256;
    add(cases, "no_saturation", "Saturation 256: nothing is a highlight.", params, nothing);
    params.saturation = 1;
    add(cases, "all_saturated", "Saturation 1: everything but black is a highlight.", params, map);
}

}  // namespace

void add_rectify_cases(std::vector<StageCase>& cases) {
    add_formats(cases);
    add_sizes(cases);
    add_parameters(cases);
    add_picture(cases, "black", "A black image after another: all usable.", 0);
    add_picture(cases, "white", "A white image after another: nothing usable.", 255);
    cases.push_back({DEFREC_STAGE_RECTIFY,
                     "map_borders",
                     "Map entries at, inside and outside the source's borders, and at the ends of "
                     "the integers.",
                     border_job,
                     compare_all_exactly,
                     true,
                     false,
                     {}});
}

}  // namespace defrec::conformance
