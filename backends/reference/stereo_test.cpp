// Properties of the definition of stereo: known surfaces are found, without a bias towards whole
// pixels, and nothing is invented.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "sdk/contract/stage_params.hpp"

namespace defrec {
namespace {

constexpr int kWidth = 240, kHeight = 100;

// Smooth random texture, a sum of waves, so that it can be sampled anywhere.
class Texture {
  public:
    explicit Texture(unsigned seed) {
        std::mt19937 random(seed);
        const auto uniform = [&](double a, double b) {
            return a + (b - a) * double(random() % 10000) / 10000;
        };
        for (Wave& wave : waves_)
            wave = {uniform(-0.9, 0.9), uniform(-0.9, 0.9), uniform(0, 6.28), uniform(2, 6)};
    }
    double operator()(double x, double y) const {
        double value = 120;
        for (const Wave& wave : waves_)
            value += wave.height * std::sin(wave.u * x + wave.v * y + wave.phase);
        return value;
    }

  private:
    struct Wave {
        double u, v, phase, height;
    };
    Wave waves_[40];
};

struct Result {
    std::vector<int16_t> disparity;
    std::vector<uint8_t> confidence;
    double at(int x, int y) const { return disparity[size_t(y * kWidth + x)] / 16.0; }
    bool known(int x, int y) const {
        return disparity[size_t(y * kWidth + x)] != DEFREC_DISPARITY_NONE;
    }
};

using Image = std::function<double(int, int)>;

Result match(const Image& left, const Image& right, const std::vector<uint8_t>& left_mask = {}) {
    std::vector<uint8_t> images[2];
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            images[0].push_back(uint8_t(std::clamp(std::lround(left(x, y)), 0l, 255l)));
            images[1].push_back(uint8_t(std::clamp(std::lround(right(x, y)), 0l, 255l)));
        }
    defrec_stereo_params params{};
    params.width = kWidth;
    params.height = kHeight;
    params.disparities = 48;
    fill_defaults(params);
    Result result{std::vector<int16_t>(images[0].size()), std::vector<uint8_t>(images[0].size())};
    const InBuffer in[] = {{images[0].data(), images[0].size()},
                           {images[1].data(), images[1].size()},
                           {left_mask.empty() ? nullptr : left_mask.data(), left_mask.size()}};
    const OutBuffer out[] = {{result.disparity.data(), result.disparity.size() * 2},
                             {result.confidence.data(), result.confidence.size()}};
    const test::TestHost host;
    reference::make_stereo(params, host.host())->run(in, out);
    return result;
}

struct Errors {
    double mean, largest, coverage;
};

Errors errors(const Result& result, const std::function<double(int, int)>& truth, int x0 = 50,
              int x1 = kWidth - 10) {
    double sum = 0, largest = 0;
    int known = 0, all = 0;
    for (int y = 10; y < kHeight - 10; ++y)
        for (int x = x0; x < x1; ++x) {
            ++all;
            if (!result.known(x, y)) continue;
            const double error = result.at(x, y) - truth(x, y);
            sum += error;
            largest = std::max(largest, std::abs(error));
            ++known;
        }
    return {sum / std::max(1, known), largest, double(known) / all};
}

TEST_CASE("a plane facing the camera is found at any fraction of a pixel, without bias") {
    const Texture texture(3);
    for (double d = 20; d < 21; d += 0.125) {
        CAPTURE(d);
        const Result result = match([&](int x, int y) { return texture(x - d, y); },
                                    [&](int x, int y) { return texture(x, y); });
        const Errors found = errors(result, [&](int, int) { return d; });
        CHECK(std::abs(found.mean) < 0.04);
        CHECK(found.largest < 0.25);
        CHECK(found.coverage > 0.99);
    }
}

TEST_CASE("a slanted plane is found under a gain and an offset between the views") {
    const Texture texture(4);
    const auto truth = [](int x, int y) { return 15 + 0.06 * x + 0.05 * y; };
    const Result result = match([&](int x, int y) { return texture(x - truth(x, y), y); },
                                [&](int x, int y) { return 0.8 * texture(x, y) + 20; });
    const Errors found = errors(result, truth);
    CHECK(std::abs(found.mean) < 0.05);
    CHECK(found.largest < 0.6);
    CHECK(found.coverage > 0.97);
}

TEST_CASE(
    "what the right view cannot see is a hole, and the far side of an edge is not pulled to the "
    "near one") {
    const Texture far(5), near(6);
    // A near strip whose left edge is at x = 120 in the left image covers the right view: shift of
    // 20 px left of it.
    const auto right = [&](int x, int y) { return x >= 80 && x < 140 ? near(x, y) : far(x, y); };
    const Result result =
        match([&](int x, int y) { return x >= 120 && x < 180 ? near(x - 40, y) : far(x - 20, y); },
              right);
    int invented = 0;
    for (int y = 10; y < kHeight - 10; ++y)
        for (int x = 50; x < kWidth - 10; ++x) {
            const bool strip = x >= 120 && x < 180;
            invented += result.known(x, y) && std::abs(result.at(x, y) - (strip ? 40 : 20)) > 2;
        }
    CHECK(invented < (kHeight - 20) * (kWidth - 60) / 100);
    int occluded = 0;
    for (int y = 10; y < kHeight - 10; ++y)
        for (int x = 106; x < 114; ++x) occluded += result.known(x, y);
    CHECK(occluded < (kHeight - 20) * 8 / 4);
}

TEST_CASE("row 61: a masked region has no evidence of its own; a small one is filled") {
    const Texture texture(7);
    std::vector<uint8_t> mask(size_t{kWidth} * kHeight, 255);
    const auto cut = [&](int x0, int size) {
        for (int y = 40; y < 40 + size; ++y)
            std::fill_n(mask.begin() + y * kWidth + x0, size, uint8_t{0});
    };
    cut(80, 40);
    cut(160, 6);
    const auto left = [&](int x, int y) {
        return mask[size_t(y * kWidth + x)] ? texture(x - 20, y) : 255.0;
    };
    const Result result = match(
        left, [&](int x, int y) { return texture(x, y); }, mask);
    CHECK_FALSE(result.known(100, 60));
    CHECK(result.confidence[60 * kWidth + 100] == 0);
    REQUIRE(result.known(162, 42));
    CHECK(std::abs(result.at(162, 42) - 20) < 0.3);
    CHECK(result.confidence[42 * kWidth + 162] < result.confidence[42 * kWidth + 200]);
}

TEST_CASE("row 68: repetitive texture is refused") {
    const Texture texture(8);
    const auto stripes = [](int x, int) { return 120 + 60 * std::sin(x * 6.283185 / 14); };
    const Errors found = errors(match(stripes, stripes), [](int, int) { return 0.0; });
    CHECK(found.coverage < 0.05);
    const Errors plain = errors(match([&](int x, int y) { return texture(x, y); },
                                      [&](int x, int y) { return texture(x, y); }),
                                [](int, int) { return 0.0; });
    CHECK(plain.coverage > 0.95);
}

TEST_CASE("row 62: noise without a surface leaves almost nothing") {
    std::mt19937 random(9);
    const auto noise = [&](int, int) { return 100.0 + double(random() % 20); };
    CHECK(errors(match(noise, noise), [](int, int) { return 0.0; }).coverage < 0.1);
}

TEST_CASE("parameters beyond the limits and short buffers are refused") {
    const test::TestHost host;
    defrec_stereo_params params{};
    params.width = 64;
    params.height = 48;
    fill_defaults(params);
    std::vector<uint8_t> image(64 * 48);
    std::vector<int16_t> disparity(64 * 48 - 1);
    const InBuffer in[] = {{image.data(), image.size()}, {image.data(), image.size()}};
    const OutBuffer out[] = {{disparity.data(), disparity.size() * 2}};
    CHECK_THROWS_AS(reference::make_stereo(params, host.host())->run(in, out), StageError);
    params.disparities = 511;
    CHECK_THROWS_AS(reference::make_stereo(params, host.host()), StageError);
    params.disparities = 64;
    params.radius = 7;
    CHECK_THROWS_AS(reference::make_stereo(params, host.host()), StageError);
}

}  // namespace
}  // namespace defrec
