// Sizes, limits, constants and buffers of stage stereo that every host-memory backend shares;
// docs/stages/stereo.md.
#pragma once
#include <algorithm>

#include "backends/shared/stage.hpp"

namespace defrec {

constexpr int kNoDisparity = DEFREC_DISPARITY_NONE;
constexpr int kInpaintRadius = 8;
constexpr int kGroup = 4;  // disparities of the search that share one entry of the uniqueness test
constexpr int kSupportRange = 32;     // 1/16 px of half resolution
constexpr int kEdgeRadius = 4;        // px of half resolution
constexpr int kHalfSmoothRadius = 2;  // px of half resolution
constexpr int kSearchSmoothRange = 24, kHalfSmoothRange = 16;
constexpr int kUpsampleRange = 48;  // 1/16 px of half resolution
constexpr int kTrustedScore =
    512;  // 1/4096: least refined ZNCC where the search has settled the disparity
constexpr int kFilledConfidence = 8;
// What is known of a pixel's hypothesis before it is refined.
enum : uint8_t { kDoubtful = 0, kOpen = 1, kSettled = 2 };
// round(32768 / n): 1/n in 15 bits, for means over up to 7 neighbours.
constexpr int kReciprocal[8] = {0, 32767, 16384, 10923, 8192, 6554, 5461, 4681};

struct StereoSizes {
    explicit StereoSizes(const defrec_stereo_params& p)
        : width(int(p.width)),
          height(int(p.height)),
          stride(int(p.stride)),
          half_width(width / 2),
          half_height(height / 2),
          first(p.min_disparity / 2),
          count((p.min_disparity + int(p.disparities) - 1) / 2 - first + 1) {}

    size_t pixels() const { return size_t(width) * size_t(height); }
    size_t half_pixels() const { return size_t(half_width) * size_t(half_height); }

    int width, height, stride;
    int half_width, half_height;
    int first, count;  // disparities searched at half resolution: first .. first + count - 1
};

// Scores of the search are 1 / n of the correlation coefficient, n pixels in the window; this is
// 1/4096 of the coefficient.
inline float search_score_unit(int radius) {
    return 0x1p-12f / float((2 * radius + 1) * (2 * radius + 1));
}

struct StereoBuffers {
    const uint8_t *left, *right, *left_mask, *right_mask;  // the masks may be nullptr
    int16_t* disparity;                                    // stride elements from row to row
    uint8_t* confidence;                                   // the same; may be nullptr
    // The results of the sub-stages, without gaps between rows; may be nullptr.
    uint8_t *prepared_left, *prepared_right;
    int32_t *left_keys, *right_keys;
    int16_t *checked, *supported, *dense, *half_refined, *hypothesis, *refined, *score, *evidence,
        *filled;
};

inline StereoBuffers stereo_buffers(const StereoSizes& size, std::span<const InBuffer> in,
                                    std::span<const OutBuffer> out) {
    expect_buffers("stereo in", in, 2, 2);
    expect_buffers("stereo out", out, 1, 14);
    const size_t image = size_t(size.stride) * size_t(size.height - 1) + size_t(size.width);
    const size_t full = size.pixels(), half = size.half_pixels();
    StereoBuffers b;
    b.left = take<uint8_t>("stereo left", in[0], image);
    b.right = take<uint8_t>("stereo right", in[1], image);
    b.left_mask = take_optional<uint8_t>("stereo left mask", in, 2, image);
    b.right_mask = take_optional<uint8_t>("stereo right mask", in, 3, image);
    b.disparity = take<int16_t>("stereo disparity", out[0], image);
    b.confidence = take_optional<uint8_t>("stereo confidence", out, 1, image);
    b.prepared_left = take_optional<uint8_t>("stereo prepared left", out, 2, full);
    b.prepared_right = take_optional<uint8_t>("stereo prepared right", out, 3, full);
    b.left_keys = take_optional<int32_t>("stereo left keys", out, 4, half);
    b.right_keys = take_optional<int32_t>("stereo right keys", out, 5, half);
    b.checked = take_optional<int16_t>("stereo checked", out, 6, half);
    b.supported = take_optional<int16_t>("stereo supported", out, 7, half);
    b.dense = take_optional<int16_t>("stereo dense", out, 8, half);
    b.half_refined = take_optional<int16_t>("stereo half refined", out, 9, half);
    b.hypothesis = take_optional<int16_t>("stereo hypothesis", out, 10, full);
    b.refined = take_optional<int16_t>("stereo refined", out, 11, full);
    b.score = take_optional<int16_t>("stereo score", out, 12, full);
    b.evidence = take_optional<int16_t>("stereo evidence", out, 13, full);
    b.filled = take_optional<int16_t>("stereo filled", out, 14, full);
    return b;
}

}  // namespace defrec
