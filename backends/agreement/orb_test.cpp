// The stage orb against the reference, bit by bit in every sub-stage, and properties of its
// definition.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <random>
#include <vector>

#include "backends/definition/orb_definition.hpp"
#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "sdk/contract/parameter_ends.hpp"
#include "sdk/contract/stage_params.hpp"
#include DEFREC_UNDER_TEST

namespace {

using namespace defrec;

struct Picture {
    uint32_t width, height, stride;
    std::vector<uint8_t> pixels;
    uint8_t& at(uint32_t x, uint32_t y) { return pixels[size_t(y) * stride + x]; }
};

Picture empty(uint32_t width, uint32_t height, uint32_t padding) {
    Picture picture{width, height, width + padding, {}};
    picture.pixels.assign(size_t(picture.stride) * (height - 1) + width, 0);
    return picture;
}

// Soft blobs with noise: corners of many strengths.
Picture blobs(uint32_t width, uint32_t height, uint32_t padding, uint32_t seed, double angle = 0,
              double shift = 0) {
    Picture picture = empty(width, height, padding);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    struct Wave {
        double fx, fy, phase;
    };
    std::vector<Wave> waves;
    for (int i = 0; i < 24; ++i)
        waves.push_back(
            {0.6 * (unit(random) - 0.5), 0.6 * (unit(random) - 0.5), 6.28 * unit(random)});
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            const double cx = x - width / 2.0 - shift, cy = y - height / 2.0;
            const double u = std::cos(angle) * cx + std::sin(angle) * cy,
                         v = -std::sin(angle) * cx + std::cos(angle) * cy;
            double sum = 128;
            for (const Wave& wave : waves)
                sum += 14 * std::sin(wave.fx * u + wave.fy * v + wave.phase);
            picture.at(x, y) = uint8_t(std::clamp(sum + 3 * (unit(random) - 0.5), 0.0, 255.0));
        }
    return picture;
}

Picture random_bytes(uint32_t width, uint32_t height, uint32_t padding, uint32_t seed) {
    Picture picture = empty(width, height, padding);
    std::mt19937 random(seed);
    for (uint8_t& pixel : picture.pixels) pixel = uint8_t(random());
    return picture;
}

Picture mask_with_holes(uint32_t width, uint32_t height, uint32_t padding, uint32_t seed) {
    Picture picture = empty(width, height, padding);
    std::fill(picture.pixels.begin(), picture.pixels.end(), uint8_t{1});
    std::mt19937 random(seed);
    for (int hole = 0; hole < 12; ++hole) {
        const uint32_t x0 = random() % width, y0 = random() % height, side = 1 + random() % 20;
        for (uint32_t y = y0; y < std::min(height, y0 + side); ++y)
            for (uint32_t x = x0; x < std::min(width, x0 + side); ++x) picture.at(x, y) = 0;
    }
    return picture;
}

struct Result {
    uint32_t count = 0xdeadbeef;
    std::vector<defrec_feature> features;
    std::vector<uint8_t> pyramid, scores, distances;
    std::vector<uint16_t> smoothed;
    std::vector<uint32_t> corners;
};

defrec_orb_params params_for(const Picture& picture) {
    defrec_orb_params params;
    DEFREC_INIT(&params);
    params.width = picture.width;
    params.height = picture.height;
    params.stride = picture.stride;
    fill_defaults(params);
    return params;
}

Result run(Stage& stage, const defrec_orb_params& params, const Picture& gray, const Picture* mask,
           size_t outputs = 7) {
    const orb::Layout layout = orb::make_layout(params);
    Result result;
    result.features.resize(params.capacity);
    std::memset(result.features.data(), 0x5a, params.capacity * sizeof(defrec_feature));
    result.pyramid.resize(layout.pixels);
    result.smoothed.resize(layout.pixels);
    result.scores.resize(layout.pixels);
    result.corners.resize(layout.cells);
    result.distances.resize(layout.cells);
    const InBuffer in[] = {{gray.pixels.data(), gray.pixels.size()},
                           mask ? InBuffer{mask->pixels.data(), mask->pixels.size()} : InBuffer{}};
    const auto buffer = [](auto& values) {
        return OutBuffer{values.data(), values.size() * sizeof values[0]};
    };
    const OutBuffer out[] = {{&result.count, 4},      buffer(result.features),
                             buffer(result.pyramid),  buffer(result.smoothed),
                             buffer(result.scores),   buffer(result.corners),
                             buffer(result.distances)};
    stage.run(in, std::span(out).first(outputs));
    return result;
}

void check_equal(const Result& a, const Result& b) {
    CHECK(a.pyramid == b.pyramid);
    CHECK(a.smoothed == b.smoothed);
    CHECK(a.scores == b.scores);
    CHECK(a.corners == b.corners);
    CHECK(a.distances == b.distances);
    CHECK(a.count == b.count);
    REQUIRE(a.features.size() ==
            b.features.size());  // those behind the number too: nobody writes them
    CHECK(std::memcmp(a.features.data(), b.features.data(),
                      a.features.size() * sizeof(defrec_feature)) == 0);
}

// What the reference and the backend agree on, whatever the number of threads and the instruction
// set.
Result agreed(const defrec_orb_params& params, const Picture& gray, const Picture* mask = nullptr) {
    const test::TestHost one(1), four(4);
    const auto expected = run(*reference::make_orb(params, one.host()), params, gray, mask);
    under_test::on_every_target([&] {
        const auto stage = under_test::make_orb(params, four.host());
        check_equal(run(*stage, params, gray, mask), expected);
        check_equal(run(*stage, params, gray, mask), expected);
        check_equal(run(*under_test::make_orb(params, one.host()), params, gray, mask), expected);
    });
    return expected;
}

TEST_CASE("equals the reference at odd sizes and padded strides, with and without a mask") {
    if (!under_test::available()) return;
    const uint32_t sizes[][3] = {
        {64, 48, 0}, {65, 49, 3}, {131, 97, 0}, {311, 239, 9}, {100, 203, 28}};
    for (const auto& size : sizes) {
        CAPTURE(size[0]);
        const Picture gray = blobs(size[0], size[1], size[2], size[0]);
        const Picture mask = mask_with_holes(size[0], size[1], size[2], size[1]);
        const defrec_orb_params params = params_for(gray);
        const Result all = agreed(params, gray);
        const Result masked = agreed(params, gray, &mask);
        CHECK(all.count > 0);
        CHECK(masked.scores != all.scores);
    }
}

TEST_CASE("equals the reference with other parameters, cut to the capacity") {
    if (!under_test::available()) return;
    const Picture noise = random_bytes(211, 160, 5, 7);
    for (uint32_t cell : {4u, 7u, 11u, 16u})
        for (uint32_t capacity : {1u, 40u, 333u}) {
            CAPTURE(cell);
            CAPTURE(capacity);
            defrec_orb_params params = params_for(noise);
            params.cell = cell;
            params.capacity = capacity;
            params.levels = capacity == 333 ? 8 : 3;
            params.threshold = capacity == 1 ? 1 : 60;
            const Result result = agreed(params, noise);
            CHECK(result.count <= capacity);
            const auto corners =
                uint32_t(result.corners.size() -
                         size_t(std::count(result.corners.begin(), result.corners.end(), 0u)));
            CHECK(result.count >= std::min(capacity, corners) / 2);
        }
}

TEST_CASE("equals the reference with each parameter at the ends of its range") {
    if (!under_test::available()) return;
    const Picture noise = random_bytes(211, 160, 5, 8);
    for_parameter_ends(params_for(noise), [&](const char* name, const defrec_orb_params& params) {
        CAPTURE(name);
        agreed(params, noise);
    });
}

TEST_CASE("equals the reference on halved images") {
    if (!under_test::available()) return;
    const uint32_t sizes[][3] = {{64, 48, 0}, {207, 163, 5}, {643, 481, 0}};
    for (const auto& size : sizes)
        for (uint32_t halvings : {1u, 2u, 3u}) {
            CAPTURE(size[0]);
            CAPTURE(halvings);
            const Picture gray = random_bytes(size[0], size[1], size[2], halvings);
            const Picture mask = mask_with_holes(size[0], size[1], size[2], halvings);
            defrec_orb_params params = params_for(gray);
            params.halvings = halvings;
            params.levels = size[0] == 64 ? 8 : 3;
            CHECK((agreed(params, gray).count > 0) == (orb::make_layout(params).cells > 0));
            agreed(params, gray, &mask);
        }
}

TEST_CASE("features of an image doubled in size are its own, between pixels of twice the size") {
    if (!under_test::available()) return;
    Picture gray = blobs(201, 163, 0, 4), mask = mask_with_holes(201, 163, 0, 5);
    // The odd row and column that the first halving leaves are dropped.
    const auto doubled = [](Picture& from) {
        Picture to = empty(2 * from.width + 1, 2 * from.height + 1, 3);
        for (uint32_t y = 0; y < to.height; ++y)
            for (uint32_t x = 0; x < to.width; ++x)
                to.at(x, y) = x / 2 < from.width && y / 2 < from.height ? from.at(x / 2, y / 2) : 0;
        return to;
    };
    const Result expected = agreed(params_for(gray), gray, &mask);
    REQUIRE(expected.count > 20);
    for (uint32_t halvings = 1; halvings <= uint32_t(kOrbMaxHalvings); ++halvings) {
        gray = doubled(gray);
        mask = doubled(mask);
        defrec_orb_params params = params_for(gray);
        params.halvings = halvings;
        Result result = agreed(params, gray, &mask);
        for (uint32_t i = 0; i < result.count && i < expected.count; ++i) {
            defrec_feature& found = result.features[i];
            const defrec_feature& feature = expected.features[i];
            // Pixel 0 of half the size has its centre at 1/2, half a pixel of the smaller image is
            // rounded to a sixteenth.
            const auto near = [&](int32_t large, int32_t small) {
                const int32_t unit = 1 << halvings, exact = unit * (small + 8) - 8;
                return std::abs(large - exact) <= (feature.level == 0 ? 0 : unit / 2);
            };
            CHECK(near(found.x, feature.x));
            CHECK(near(found.y, feature.y));
            found.x = feature.x;
            found.y = feature.y;
        }
        check_equal(result, expected);
    }
}

TEST_CASE("equals the reference where cells are many") {
    if (!under_test::available()) return;
    const Picture noise = random_bytes(900, 700, 0, 3);
    defrec_orb_params params = params_for(noise);
    params.cell = 4;
    params.levels = 1;
    params.capacity = 5000;
    REQUIRE(orb::make_layout(params).cells > 32768);
    const test::TestHost host;
    const Result expected = run(*reference::make_orb(params, host.host()), params, noise, nullptr);
    CHECK(expected.count > 4000);
    check_equal(run(*under_test::make_orb(params, host.host()), params, noise, nullptr), expected);
}

TEST_CASE("without the optional outputs, and with some of them, the features are the same") {
    if (!under_test::available()) return;
    const Picture gray = blobs(260, 200, 1, 2);
    const defrec_orb_params params = params_for(gray);
    const test::TestHost host;
    const Result expected = run(*reference::make_orb(params, host.host()), params, gray, nullptr);
    const auto stage = under_test::make_orb(params, host.host());
    for (const size_t outputs : {2u, 4u, 6u, 7u}) {
        CAPTURE(outputs);
        const Result result = run(*stage, params, gray, nullptr, outputs);
        CHECK(result.count == expected.count);
        CHECK(std::memcmp(result.features.data(), expected.features.data(),
                          expected.features.size() * sizeof(defrec_feature)) == 0);
        CHECK((outputs < 4 || result.smoothed == expected.smoothed));
        CHECK((outputs < 6 || result.corners == expected.corners));
    }
}

TEST_CASE("a flat image and one without corners above the threshold have no features") {
    if (!under_test::available()) return;
    Picture flat = empty(96, 80, 0);
    std::fill(flat.pixels.begin(), flat.pixels.end(), uint8_t{77});
    CHECK(agreed(params_for(flat), flat).count == 0);
    for (uint32_t y = 0; y < 80; ++y)
        for (uint32_t x = 0; x < 96; ++x) flat.at(x, y) = uint8_t(100 + (x > 40 && y > 40 ? 3 : 0));
    CHECK(agreed(params_for(flat), flat).count ==
          0);  // the threshold is 5, and a score must be above it
    for (uint32_t y = 0; y < 80; ++y)
        for (uint32_t x = 0; x < 96; ++x) flat.at(x, y) = uint8_t(100 + (x > 40 && y > 40 ? 5 : 0));
    CHECK(agreed(params_for(flat), flat).count > 0);
}

TEST_CASE(
    "features keep their distance, stay off the border and off masked pixels, and come in order") {
    if (!under_test::available()) return;
    const Picture gray = blobs(320, 240, 0, 3);
    const Picture mask = mask_with_holes(320, 240, 0, 4);
    defrec_orb_params params = params_for(gray);
    params.spacing = 11;
    params.levels = 1;
    const Result result = agreed(params, gray, &mask);
    REQUIRE(result.count > 20);
    for (uint32_t i = 0; i < result.count; ++i) {
        const defrec_feature& a = result.features[i];
        const int32_t x = (a.x + 8) >> 4, y = (a.y + 8) >> 4;
        CHECK((x >= orb::kBorder && y >= orb::kBorder && x < 320 - orb::kBorder &&
               y < 240 - orb::kBorder));
        for (int32_t dy = -3; dy <= 3; ++dy)
            for (int32_t dx = -3; dx <= 3; ++dx)
                CHECK(mask.pixels[size_t((y + dy) * 320 + x + dx)] != 0);
        for (uint32_t k = 0; k < i; ++k) {
            const defrec_feature& b = result.features[k];
            CHECK(std::max(std::abs(x - ((b.x + 8) >> 4)), std::abs(y - ((b.y + 8) >> 4))) >= 11);
        }
        if (i > 0) {
            const auto cell = [&](const defrec_feature& f) {
                return (((f.y + 8) >> 4) - orb::kBorder) / 8 * 1000 +
                       (((f.x + 8) >> 4) - orb::kBorder) / 8;
            };
            CHECK(cell(result.features[i - 1]) < cell(a));
        }
    }
}

TEST_CASE("equals the reference where corners are few and far between") {
    if (!under_test::available()) return;
    for (uint32_t dots : {12u, 60u, 200u}) {
        Picture gray = empty(420, 330, 0);
        std::mt19937 random(dots);
        for (uint32_t dot = 0; dot < dots; ++dot) {
            const uint32_t x0 = random() % 416, y0 = random() % 326, level = 40 + random() % 8 * 10;
            for (uint32_t y = y0; y < y0 + 4; ++y)
                for (uint32_t x = x0; x < x0 + 4; ++x) gray.at(x, y) = uint8_t(level);
        }
        for (uint32_t cell : {5u, 8u}) {
            defrec_orb_params params = params_for(gray);
            params.cell = cell;
            const Result result = agreed(params, gray);
            CHECK(std::count(result.distances.begin(), result.distances.end(),
                             uint8_t(orb::kFarthest)) > 0);
        }
    }
}

TEST_CASE(
    "a smaller capacity spreads the features over the whole image instead of emptying a part of "
    "it") {
    if (!under_test::available()) return;
    Picture gray = blobs(400, 320, 0, 5);
    for (uint32_t y = 0; y < 320; ++y)  // the right half is of low contrast
        for (uint32_t x = 200; x < 400; ++x)
            gray.at(x, y) = uint8_t(128 + (gray.at(x, y) - 128) / 4);
    defrec_orb_params params = params_for(gray);
    params.capacity = 100;
    const Result result = agreed(params, gray);
    REQUIRE(result.count >= 80);
    uint32_t right = 0;
    for (uint32_t i = 0; i < result.count; ++i) right += result.features[i].x > 200 * 16 ? 1 : 0;
    CHECK(right > result.count / 4);
}

TEST_CASE("positions of every level are those of the image, to half a pixel of the level") {
    if (!under_test::available()) return;
    for (uint32_t level = 0; level < kOrbMaxLevels; ++level)
        for (uint32_t x : {0u, 1u, 17u, 200u, 1700u})
            for (uint32_t halvings = 0; halvings <= uint32_t(kOrbMaxHalvings); ++halvings) {
                const double scale = std::pow(1.25, level) * std::pow(2.0, halvings);
                if ((x + 1) * scale > int{DEFREC_MAX_SIDE}) continue;
                CHECK(std::abs(orb::to_image(16 * x + 3, level, halvings) -
                               (16 * ((x + 0.5) * scale - 0.5) + 3 * scale)) <= 0.51);
            }
    constexpr uint32_t kLast = 8192 * 64 / 125 * 64 / 125 * 4 / 5;  // width of level 7
    CHECK(orb::to_image(16 * kLast - 9, 7, 0) < 8192 * 16);
    CHECK(orb::to_image(16 * kLast - 9, 7, 0) > 8180 * 16);
    CHECK(orb::to_image(16 * (kLast / 8) - 9, 7, 3) < 8192 * 16);
    CHECK(orb::to_image(16 * (kLast / 8) - 9, 7, 3) > 8000 * 16);
}

TEST_CASE("positions follow a shift of a fraction of a pixel") {
    if (!under_test::available()) return;
    CHECK(orb::peak(10, 20, 10) == 0);
    CHECK(orb::peak(10, 20, 20) == 7);
    CHECK(orb::peak(14, 20, 10) == -2);
    CHECK(orb::peak(20, 20, 20) == 0);
    CHECK(orb::peak(255, 1, 0) == 0);
    const Picture still = blobs(300, 260, 0, 9);
    const Result a = agreed(params_for(still), still);
    for (double shift : {0.25, 0.5}) {
        const Picture moved = blobs(300, 260, 0, 9, 0, shift);
        const Result b = agreed(params_for(moved), moved);
        double sum = 0, count = 0;
        for (uint32_t i = 0; i < a.count; ++i)
            for (uint32_t k = 0; k < b.count; ++k) {
                const int32_t dx = b.features[k].x - a.features[i].x,
                              dy = b.features[k].y - a.features[i].y;
                if (a.features[i].level != b.features[k].level || std::abs(dx) > 24 ||
                    std::abs(dy) > 24)
                    continue;
                sum += dx / 16.0;
                ++count;
            }
        REQUIRE(count > 50);
        CHECK(sum / count == doctest::Approx(shift).epsilon(0.25));
    }
}

TEST_CASE("orientation bins are those of the angle, and descriptors turn with the image") {
    if (!under_test::available()) return;
    for (int32_t k = 0; k < 720; ++k) {
        const double angle = k * std::numbers::pi / 360 + 0.003;
        const uint32_t bin = orb::angle_bin(int32_t(std::lround(500000 * std::cos(angle))),
                                            int32_t(std::lround(500000 * std::sin(angle))));
        const double off =
            std::remainder(angle - bin * 2 * std::numbers::pi / 32, 2 * std::numbers::pi);
        CHECK(std::abs(off) < std::numbers::pi / 32 + 0.002);
    }
    CHECK(orb::angle_bin(0, 0) == 0);

    const Picture upright = blobs(257, 257, 0, 6),
                  turned = blobs(257, 257, 0, 6, std::numbers::pi / 2);
    const Result a = agreed(params_for(upright), upright), b = agreed(params_for(turned), turned);
    uint32_t found = 0, near = 0;
    for (uint32_t i = 0; i < a.count; ++i) {
        if (a.features[i].level != 0) continue;
        const int32_t x = 16 * 257 - a.features[i].y, y = a.features[i].x;
        for (uint32_t k = 0; k < b.count; ++k) {
            if (b.features[k].level != 0 || std::abs(b.features[k].x - x) > 24 ||
                std::abs(b.features[k].y - y) > 24)
                continue;
            int distance = 0;
            for (int word = 0; word < 8; ++word)
                distance += __builtin_popcount(a.features[i].descriptor[word] ^
                                               b.features[k].descriptor[word]);
            ++found;
            near += distance < 64 ? 1 : 0;
            break;
        }
    }
    CHECK(found > 20);
    CHECK(near > found * 3 / 4);
}

TEST_CASE("row 24: buffers that are too small or missing are refused with the size needed") {
    if (!under_test::available()) return;
    const Picture gray = blobs(80, 64, 0, 1);
    const defrec_orb_params params = params_for(gray);
    const test::TestHost host;
    for (const auto& stage :
         {reference::make_orb(params, host.host()), under_test::make_orb(params, host.host())}) {
        uint32_t count = 0;
        std::vector<defrec_feature> features(params.capacity);
        const auto status_of = [&](uint64_t gray_size, uint64_t feature_size) {
            const InBuffer in[] = {{gray.pixels.data(), gray_size}};
            const OutBuffer out[] = {{&count, 4}, {features.data(), feature_size}};
            try {
                stage->run(in, out);
            } catch (const StageError& error) {
                return error.status();
            }
            return defrec_status(DEFREC_OK);
        };
        CHECK(status_of(80 * 64, features.size() * 48) == DEFREC_OK);
        CHECK(status_of(80 * 64 - 1, features.size() * 48) == DEFREC_ERROR_ARGUMENT);
        CHECK(status_of(80 * 64, features.size() * 48 - 1) == DEFREC_ERROR_ARGUMENT);
    }
}

TEST_CASE("parameters out of range are refused") {
    if (!under_test::available()) return;
    const Picture gray = empty(80, 64, 0);
    const test::TestHost host;
    const auto refused = [&](auto change) {
        defrec_orb_params params = params_for(gray);
        change(params);
        CHECK_THROWS_AS(under_test::make_orb(params, host.host()), StageError);
        CHECK_THROWS_AS(reference::make_orb(params, host.host()), StageError);
    };
    refused([](auto& p) { p.width = 63; });
    refused([](auto& p) { p.stride = p.width - 1; });
    refused([](auto& p) { p.levels = 9; });
    refused([](auto& p) { p.cell = 17; });
    refused([](auto& p) { p.threshold = 255; });
    refused([](auto& p) { p.capacity = 65536; });
    refused([](auto& p) { p.spacing = 64; });
    refused([](auto& p) { p.halvings = 4; });
}

}  // namespace
