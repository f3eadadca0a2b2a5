// See jobs.hpp.
#include "conformance/scenes/jobs.hpp"

#include <algorithm>

#include "backends/stages/orb.hpp"

namespace defrec::conformance {
namespace {

template <class Params>
const Params& complete(const StageJob& job) {
    return *static_cast<const Params*>(job.params.get());
}

Input optional_picture(const Gray* picture, uint32_t stride) {
    return picture == nullptr ? not_given() : picture_input(*picture, stride);
}

}  // namespace

Input colour_input(const Gray& picture, uint32_t format, uint32_t stride_bytes) {
    const uint32_t channels = format == DEFREC_FORMAT_GRAY8   ? 1
                              : format == DEFREC_FORMAT_BGRA8 ? 4
                                                              : 3;
    std::vector<uint8_t> pixels;
    for (const uint8_t gray : picture.pixels)
        for (uint32_t c = 0; c < channels; ++c)
            pixels.push_back(uint8_t(c == 3 ? gray * 7 : std::min(255, gray + 23 * int(c))));
    Input input = image_input(pixels, picture.width * channels, picture.height, stride_bytes);
    return input;
}

// ---- rectify ----------------------------------------------------------------

StageJob rectify_job(const defrec_rectify_params& params, const Gray& source,
                     const std::vector<int32_t>* map, const Gray* ignore) {
    StageJob job(DEFREC_STAGE_RECTIFY, &params);
    const auto& p = complete<defrec_rectify_params>(job);
    job.in.push_back(colour_input(source, p.format, p.source_stride));
    job.in.push_back(map == nullptr ? not_given() : records(*map));
    job.in.push_back(ignore == nullptr ? not_given() : records(ignore->pixels));
    job.out.push_back(image_output<uint8_t>("gray", p.width, p.height, p.stride));
    job.out.push_back(image_output<uint8_t>("mask", p.width, p.height, p.stride));
    return job;
}

std::vector<int32_t> bent_map(const defrec_rectify_params& params, uint64_t seed) {
    const uint32_t width = params.width == 0 ? params.source_width : params.width,
                   height = params.height == 0 ? params.source_height : params.height;
    Random random(seed);
    std::vector<int32_t> map;
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            const double u = double(x) / width - 0.5, v = double(y) / height - 0.5,
                         bend = 1 + 0.3 * (u * u + v * v);
            const bool outside = random.below(97) == 0;
            map.push_back(
                outside ? INT32_MIN
                        : int32_t(128 * params.source_width * (0.5 + 1.05 * bend * u + 0.03 * v)) +
                              int32_t(random.below(9)));
            map.push_back(
                outside ? INT32_MIN
                        : int32_t(128 * params.source_height * (0.5 + 1.05 * bend * v - 0.03 * u)));
        }
    return map;
}

// ---- stereo -----------------------------------------------------------------

StageJob stereo_job(const defrec_stereo_params& params, const Gray& left, const Gray& right,
                    const Gray* left_mask, const Gray* right_mask, bool extras) {
    StageJob job(DEFREC_STAGE_STEREO, &params);
    const auto& p = complete<defrec_stereo_params>(job);
    const uint32_t w = p.width, h = p.height, w2 = w / 2, ws = (w + 1) / 2, hs = (h + 1) / 2,
                   w4 = (w2 + 1) / 2, h4 = (h / 2 + 1) / 2;
    job.in = {picture_input(left, p.stride), picture_input(right, p.stride),
              optional_picture(left_mask, p.stride), optional_picture(right_mask, p.stride)};
    job.out = {image_output<int16_t>("disparity", w, h, p.stride),
               image_output<uint8_t>("confidence", w, h, p.stride),
               image_output<uint8_t>("left inpainted", w, h, w),
               image_output<uint8_t>("right inpainted", w, h, w),
               image_output<int32_t>("left winners", w4, h4, w4),
               image_output<int32_t>("right winners", w2, h4, w2),
               image_output<int16_t>("checked", w4, h4, w4),
               image_output<int16_t>("supported", w4, h4, w4),
               image_output<int16_t>("dense", w4, h4, w4),
               image_output<int16_t>("half refined", w4, h4, w4),
               image_output<int16_t>("hypothesis", w, h, w),
               image_output<int16_t>("refined", ws, hs, ws),
               image_output<int16_t>("score", ws, hs, ws),
               image_output<int16_t>("evidence", ws, hs, ws),
               image_output<int16_t>("filled", ws, hs, ws)};
    if (!extras)
        for (size_t i = 1; i < job.out.size(); ++i) job.out[i].given = false;
    return job;
}

// ---- orb --------------------------------------------------------------------

StageJob orb_job(const defrec_orb_params& params, const Gray& picture, const Gray* mask,
                 bool extras) {
    StageJob job(DEFREC_STAGE_ORB, &params);
    const auto& p = complete<defrec_orb_params>(job);
    const orb::Layout layout = orb::make_layout(p);
    job.in = {picture_input(picture, p.stride), optional_picture(mask, p.stride)};
    job.out = {record_output<uint32_t>("number", 1),
               record_output<defrec_feature>("features", p.capacity),
               record_output<uint8_t>("pyramid", layout.pixels),
               record_output<uint16_t>("smoothed", layout.pixels),
               record_output<uint8_t>("scores", layout.pixels),
               record_output<uint32_t>("corners", layout.cells),
               record_output<uint8_t>("distances", layout.cells)};
    if (!extras)
        for (size_t i = 2; i < job.out.size(); ++i) job.out[i].given = false;
    return job;
}

}  // namespace defrec::conformance
