// Which level of an image's pyramid shows its texture, beside noise.
#include "sdk/template/texture_level.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "sdk/template/decisions.hpp"
#include "sdk/template/patch_places.hpp"

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 480, kHeight = 320;

// texture(x, y): gray levels about a middle one.
template <class Texture>
std::vector<uint8_t> image(double noise, const Texture& texture) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0, 1);
    std::vector<uint8_t> gray;
    for (uint32_t y = 0; y < kHeight; ++y)
        for (uint32_t x = 0; x < kWidth; ++x)
            gray.push_back(static_cast<uint8_t>(
                std::clamp(std::lround(110 + texture(x, y) + noise * normal(random)), 0L, 255L)));
    return gray;
}

// So many gray levels to either side, so many px long both ways.
auto waves(double height, double length) {
    return [=](uint32_t x, uint32_t y) {
        constexpr double kTurn = 6.283185307179586;
        return height * (std::sin(kTurn * x / length) + std::sin(kTurn * (x + 2.0 * y) / length));
    };
}

uint32_t level_of(const std::vector<uint8_t>& gray) {
    return texture_level(gray.data(), kWidth, kHeight);
}

double flat(uint32_t, uint32_t) { return 0; }

}  // namespace

TEST_CASE("the fainter a texture is beside noise, the coarser is the level that shows it") {
    CHECK(level_of(image(1.5, waves(10, 14))) == 0);
    CHECK(level_of(image(1.5, waves(1.2, 20))) == 1);
    CHECK(level_of(image(1.5, waves(0.6, 30))) == 2);
    // The noise decides, not the texture alone.
    CHECK(level_of(image(0.3, waves(1.2, 20))) == 0);
    CHECK(level_of(image(4, waves(3, 20))) == 1);
}

TEST_CASE("what is rougher than a sensor's noise is texture") {
    CHECK(level_of(image(20, flat)) == 0);
}

TEST_CASE("no texture at all is looked for on the coarsest level") {
    CHECK(level_of(image(1.5, flat)) == decisions::TextureLevel::kMaxLevel);
}

TEST_CASE("what is dark or saturated says nothing of the tissue") {
    const auto dark_around = [](uint32_t x, uint32_t y) {
        const bool is_tissue = std::hypot(x - 240.0, y - 160.0) < 90;
        return is_tissue ? waves(10, 14)(x, y) : -108.0;
    };
    CHECK(level_of(image(1.5, dark_around)) == 0);
    const auto saturated_around = [&](uint32_t x, uint32_t y) {
        return std::hypot(x - 240.0, y - 160.0) < 90 ? waves(10, 14)(x, y) : 150.0;
    };
    CHECK(level_of(image(1.5, saturated_around)) == 0);
    CHECK(level_of(image(1.5, [](uint32_t, uint32_t) { return -108.0; })) == 0);
}

TEST_CASE("faint texture within a round picture on black is faint") {
    std::vector<uint8_t> gray = image(1.5, waves(0.6, 30));
    for (uint32_t y = 0; y < kHeight; ++y)
        for (uint32_t x = 0; x < kWidth; ++x)
            if (std::hypot(x - 240.0, y - 160.0) > 135) gray[y * kWidth + x] = 0;
    CHECK(level_of(gray) == 2);
}

TEST_CASE("images too small for a window have level 0") {
    const std::vector<uint8_t> gray(64, 100);
    CHECK(texture_level(gray.data(), 8, 8) == 0);
    CHECK(texture_level(gray.data(), 2, 2) == 0);
    CHECK(texture_level(gray.data(), 64, 1) == 0);
}

TEST_CASE("patches lie where there is texture on its level, not where the noise is") {
    // In each cell that has a patch the left half alone has texture.
    static constexpr uint32_t kCell = 80;
    const std::vector<uint8_t> gray = image(1.5, [](uint32_t x, uint32_t y) {
        return x % kCell < kCell / 2 ? waves(1, 30)(x, y) : 0.0;
    });
    CaptureInput input;
    input.width = kWidth;
    input.height = kHeight;
    input.gray = gray.data();
    const auto in_texture = [&](uint32_t level) {
        input.texture_level = level;
        const std::vector<PatchPlace> places =
            trackable_places(input, kCell, 20, [](int, int) { return true; });
        CHECK(places.size() == kWidth / kCell * (kHeight / kCell));
        return std::count_if(places.begin(), places.end(), [](const PatchPlace& place) {
            return static_cast<uint32_t>(place.u) % kCell < kCell / 2;
        });
    };
    CHECK(in_texture(0) < 18);
    CHECK(in_texture(2) >= 22);
}
