// stereo equals the reference to the bit, sub-stage by sub-stage: odd sizes, padded strides, masks,
// thread counts.
#include "backends/stages/stereo.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>

#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "sdk/contract/parameter_ends.hpp"
#include "sdk/contract/stage_params.hpp"
#include DEFREC_UNDER_TEST

namespace defrec {
namespace {

struct Pair {
    std::vector<uint8_t> left, right, left_mask, right_mask;
};

// A textured wavy surface with a nearer strip in front, noise, masked blobs; rows have the
// parameters' stride.
Pair make_pair(const defrec_stereo_params& p, unsigned seed) {
    std::mt19937 random(seed);
    const int w = int(p.width), h = int(p.height), stride = int(p.stride);
    const float range = float(p.disparities) * 0.8f, maximum = float(p.min_disparity) + range;
    const int margin = std::max(300, int(maximum) + 3), columns = w + 2 * margin;
    std::vector<float> texture(size_t(columns) * size_t(h));
    for (float& value : texture) value = float(random() % 120) + 60;
    const auto sample = [&](float x, int y) {
        const int i = int(std::floor(x));
        const float part = x - float(i);
        const auto at = [&](int u) {
            return texture[size_t(y) * size_t(columns) + size_t(u + margin)];
        };
        return (1 - part) * (at(i) + at(i - 1)) / 2 + part * (at(i + 1) + at(i)) / 2;
    };
    Pair result;
    result.left.assign(size_t(stride) * size_t(h), 5);
    result.right = result.left;
    result.left_mask.assign(result.left.size(), 255);
    result.right_mask = result.left_mask;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const size_t at = size_t(y) * size_t(stride) + size_t(x);
            float d = float(p.min_disparity) + range * (0.6f + 0.1f * std::sin(float(x) / 40) +
                                                        0.1f * std::cos(float(y) / 30));
            if (x > w / 2 && x < w / 2 + w / 8 && y > h / 3) d = maximum;
            result.left[at] = uint8_t(sample(float(x) - d, y) + float(random() % 4));
            result.right[at] = uint8_t(sample(float(x), y) * 0.9f + float(random() % 4));
        }
    for (int blob = 0; blob < 6; ++blob) {
        auto& mask = blob % 2 == 0 ? result.left_mask : result.right_mask;
        const int cx = int(random() % unsigned(w)), cy = int(random() % unsigned(h)),
                  r = 2 + int(random() % 12);
        for (int y = std::max(0, cy - r); y < std::min(h, cy + r); ++y)
            for (int x = std::max(0, cx - r); x < std::min(w, cx + r); ++x)
                mask[size_t(y) * size_t(stride) + size_t(x)] = 0;
    }
    return result;
}

constexpr const char* kNames[] = {"disparity", "confidence",   "prepared left", "prepared right",
                                  "left keys", "right keys",   "checked",       "supported",
                                  "dense",     "half refined", "hypothesis",    "refined",
                                  "score",     "evidence",     "filled"};
constexpr size_t kElement[] = {2, 1, 1, 1, 4, 4, 2, 2, 2, 2, 2, 2, 2, 2, 2};

std::vector<std::vector<uint8_t>> run(Stage& stage, const defrec_stereo_params& p, const Pair& pair,
                                      bool masks) {
    std::vector<std::vector<uint8_t>> results;
    std::vector<OutBuffer> out;
    for (size_t i = 0; i < std::size(kNames); ++i) {
        const StereoConstants c = constants_of(p);
        const size_t count = i < 2              ? size_t(p.stride) * p.height
                             : i == 5           ? c.right_winners()
                             : i >= 4 && i <= 9 ? c.half_samples()
                             : i >= 11          ? c.samples()
                                                : c.pixels();
        results.emplace_back(count * kElement[i], uint8_t{77});
    }
    for (auto& result : results) out.push_back({result.data(), result.size()});
    const InBuffer in[] = {
        {pair.left.data(), pair.left.size()},
        {pair.right.data(), pair.right.size()},
        masks ? InBuffer{pair.left_mask.data(), pair.left_mask.size()} : InBuffer{},
        masks ? InBuffer{pair.right_mask.data(), pair.right_mask.size()} : InBuffer{}};
    stage.run(in, out);
    return results;
}

void check_equal(defrec_stereo_params p, bool masks, unsigned seed) {
    fill_defaults(p);
    const test::TestHost one(1), three(3);
    const Pair pair = make_pair(p, seed);
    const auto truth = run(*reference::make_stereo(p, one.host()), p, pair, masks);
    const auto stage = under_test::make_stereo(p, three.host());
    run(*stage, p, make_pair(p, seed + 1), masks);  // leaves something behind that must not matter
    const auto first = run(*stage, p, pair, masks),
               second = run(*under_test::make_stereo(p, one.host()), p, pair, masks);
    // From the first sub-stage to the last.
    for (const size_t i : {2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 1, 0}) {
        const std::string name = kNames[i];
        CAPTURE(name);
        CHECK((first[i] == truth[i]));
        CHECK((second[i] == truth[i]));
    }
}

defrec_stereo_params params_of(uint32_t width, uint32_t height, uint32_t disparities) {
    defrec_stereo_params p{};
    p.width = width;
    p.height = height;
    p.disparities = disparities;
    return p;
}

TEST_CASE("stereo equals the reference to the bit at odd sizes") {
    if (!under_test::available()) return;
    for (const auto& size : {std::tuple{64u, 48u, 16u},
                             {311u, 239u, 61u},
                             {330u, 70u, 128u},
                             {129u, 131u, 37u},
                             {65u, 49u, 200u},
                             {2u, 2u, 1u},
                             {3u, 9u, 4u},
                             {40u, 5u, 20u}}) {
        const auto width = std::get<0>(size), height = std::get<1>(size),
                   disparities = std::get<2>(size);
        CAPTURE(width);
        for (const bool masks : {false, true}) {
            CAPTURE(masks);
            defrec_stereo_params p = params_of(width, height, disparities);
            check_equal(p, masks, width);
            p.stride = width + 13;
            p.min_disparity = 5;
            check_equal(p, masks, width + 7);
        }
    }
}

TEST_CASE("stereo equals the reference to the bit with other parameters") {
    if (!under_test::available()) return;
    for (uint32_t radius = 2; radius <= 6; ++radius) {
        CAPTURE(radius);
        defrec_stereo_params p = params_of(277, 101, 48);
        p.radius = radius;
        p.refine_radius = 8 - radius;
        p.smooth_radius = 1 + radius % 3;
        p.fill_radius = radius + 2;
        p.smooth_passes = radius - 1;
        p.texture = radius * 40;
        p.left_right = radius;
        p.edge = 8 * radius;
        p.support = 3 * radius;
        check_equal(p, true, radius);
    }
}

TEST_CASE("stereo equals the reference to the bit with each parameter at the ends of its range") {
    if (!under_test::available()) return;
    for_parameter_ends(params_of(277, 101, 48),
                       [](const char* name, const defrec_stereo_params& params) {
                           CAPTURE(name);
                           check_equal(params, true, 3);
                       });
}

TEST_CASE("stereo equals the reference to the bit where disparities are the largest there are") {
    if (!under_test::available()) return;
    defrec_stereo_params p = params_of(2400, 50, 128);
    p.min_disparity = 1024;
    fill_defaults(p);
    check_equal(p, false, 4);
    const test::TestHost host;
    const auto truth = run(*reference::make_stereo(p, host.host()), p, make_pair(p, 4), false);
    const auto* disparity = reinterpret_cast<const int16_t*>(truth[0].data());
    CHECK(std::count_if(disparity, disparity + size_t{2400} * 50,
                        [](int d) { return d > 1024 * kDisparityOne; }) > 20000);
}

TEST_CASE("stereo takes a left_right beyond every difference for what accepts them all") {
    if (!under_test::available()) return;
    defrec_stereo_params p = params_of(277, 101, 48);
    fill_defaults(p);
    const test::TestHost host;
    const Pair pair = make_pair(p, 3);
    for (const auto make : {reference::make_stereo, under_test::make_stereo}) {
        p.left_right = 255;
        const auto all = run(*make(p, host.host()), p, pair, true);
        for (const uint32_t beyond : {256u, uint32_t{INT32_MAX}, UINT32_MAX}) {
            p.left_right = beyond;
            CHECK((run(*make(p, host.host()), p, pair, true) == all));
        }
    }
}

// Disparities of half resolution that are those of full resolution before, so that what the image
// before left beside the rows would pass for neighbours that agree.
TEST_CASE("stereo does not take what the images before left for support at the border") {
    if (!under_test::available()) return;
    constexpr uint32_t kWidth = 96, kHeight = 48, kDisparity = 16;
    defrec_stereo_params p = params_of(kWidth, kHeight, 2 * kDisparity);
    p.radius = p.refine_radius = 2;
    const auto flat_pair = [](uint32_t disparity) {
        std::mt19937 random(7);
        Pair pair;
        for (auto* image : {&pair.left, &pair.right, &pair.left_mask, &pair.right_mask})
            image->assign(size_t{kWidth} * kHeight, 255);
        std::vector<uint8_t> row(kWidth + kDisparity);
        for (size_t y = 0; y < kHeight; ++y) {
            for (uint8_t& value : row) value = static_cast<uint8_t>(60 + random() % 120);
            for (size_t x = 0; x < kWidth; ++x) {
                pair.left[y * kWidth + x] = row[x + kDisparity - disparity];
                pair.right[y * kWidth + x] = row[x + kDisparity];
            }
        }
        return pair;
    };
    const test::TestHost host;
    for (uint32_t support = 4; support <= 25; ++support) {
        CAPTURE(support);
        p.support = support;
        fill_defaults(p);
        const Pair pair = flat_pair(kDisparity);
        const auto stage = under_test::make_stereo(p, host.host());
        run(*stage, p, flat_pair(kDisparity / 2), false);
        CHECK((run(*stage, p, pair, false) ==
               run(*reference::make_stereo(p, host.host()), p, pair, false)));
    }
}

TEST_CASE("stereo gives the same disparities when they are all it is asked for") {
    if (!under_test::available()) return;
    defrec_stereo_params p = params_of(150, 110, 40);
    fill_defaults(p);
    p.smooth_passes = 1;
    const test::TestHost host;
    const Pair pair = make_pair(p, 3);
    const auto truth = run(*reference::make_stereo(p, host.host()), p, pair, true);
    std::vector<uint8_t> disparity(truth[0].size(), uint8_t{77});
    const InBuffer in[] = {{pair.left.data(), pair.left.size()},
                           {pair.right.data(), pair.right.size()},
                           {pair.left_mask.data(), pair.left_mask.size()},
                           {pair.right_mask.data(), pair.right_mask.size()}};
    const OutBuffer out[] = {{disparity.data(), disparity.size()}};
    under_test::make_stereo(p, host.host())->run(in, out);
    CHECK((disparity == truth[0]));
}

TEST_CASE("stereo equals the reference to the bit where the coarser fields are large too") {
    if (!under_test::available()) return;
    defrec_stereo_params p = params_of(1058, 517, 6);
    fill_defaults(p);
    const test::TestHost host;
    const Pair pair = make_pair(p, 5);
    CHECK((run(*under_test::make_stereo(p, host.host()), p, pair, true) ==
           run(*reference::make_stereo(p, host.host()), p, pair, true)));
}

TEST_CASE("rows 58 and 62: images without texture have no disparity") {
    if (!under_test::available()) return;
    for (const uint8_t value : {uint8_t{0}, uint8_t{130}, uint8_t{255}}) {
        defrec_stereo_params p = params_of(160, 90, 32);
        fill_defaults(p);
        const test::TestHost host;
        Pair pair = make_pair(p, 1);
        std::fill(pair.left.begin(), pair.left.end(), value);
        std::fill(pair.right.begin(), pair.right.end(), value);
        const auto fast = run(*under_test::make_stereo(p, host.host()), p, pair, true);
        CHECK((fast == run(*reference::make_stereo(p, host.host()), p, pair, true)));
        const auto* disparity = reinterpret_cast<const int16_t*>(fast[0].data());
        CHECK(std::all_of(disparity, disparity + 160 * 90,
                          [](int d) { return d == DEFREC_DISPARITY_NONE; }));
    }
}

}  // namespace
}  // namespace defrec
