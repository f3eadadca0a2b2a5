// See texture_level.hpp.
#include "sdk/template/texture_level.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <vector>

#include "sdk/template/decisions.hpp"

namespace defrec {
namespace {

using decisions::TextureLevel;

constexpr uint32_t kSide = 2 * TextureLevel::kWindowRadius + 1;  // px, of a window

struct Image {
    std::vector<float> pixels;
    size_t width, height;
    float at(size_t x, size_t y) const { return pixels[y * width + x]; }
};

Image halved(const Image& image) {
    Image half{{}, image.width / 2, image.height / 2};
    half.pixels.reserve(half.width * half.height);
    for (size_t y = 0; y < half.height; ++y)
        for (size_t x = 0; x < half.width; ++x)
            half.pixels.push_back((image.at(2 * x, 2 * y) + image.at(2 * x + 1, 2 * y) +
                                   image.at(2 * x, 2 * y + 1) + image.at(2 * x + 1, 2 * y + 1)) /
                                  4);
    return half;
}

// Squared gray levels.
double noise_variance(const uint8_t* gray, size_t width, size_t height) {
    std::array<size_t, 8 * 255 + 1> count{};
    double half = 0;
    for (size_t y = 0; y + 2 < height; ++y)
        for (size_t x = 0; x + 2 < width; ++x) {
            const uint8_t *a = gray + y * width + x, *b = a + width, *c = b + width;
            if (b[1] < TextureLevel::kDark || b[1] >= TextureLevel::kSaturatedFrom) continue;
            half += 0.5;
            ++count[static_cast<size_t>(std::abs(a[0] - 2 * a[1] + a[2] - 2 * b[0] + 4 * b[1] -
                                                 2 * b[2] + c[0] - 2 * c[1] + c[2]))];
        }
    double below = 0, median = 0;
    for (size_t i = 0; i < count.size(); ++i) {
        const auto here = static_cast<double>(count[i]);
        if (here > 0 && below + here >= half) {
            // Whole numbers stand for what lies within a half of them, but 0 for magnitudes.
            const double from = i == 0 ? 0 : static_cast<double>(i) - 0.5, wide = i == 0 ? 0.5 : 1;
            median = from + wide * (half - below) / here;
            break;
        }
        below += here;
    }
    const double sigma = median * TextureLevel::kMedianToSigma / TextureLevel::kDifference;
    return sigma * sigma;
}

// Variance of a window's pixels beyond a plane; none where it is dark or saturated.
std::optional<double> variance_of(const Image& image, size_t left, size_t top) {
    constexpr int kRadius = TextureLevel::kWindowRadius;
    double sum = 0, squares = 0, across = 0, down = 0, places = 0, brightest = 0, n = 0;
    for (int y = -kRadius; y <= kRadius; ++y)
        for (int x = -kRadius; x <= kRadius; ++x) {
            const double value = double{image.at(left + static_cast<size_t>(x + kRadius),
                                                 top + static_cast<size_t>(y + kRadius))};
            sum += value;
            squares += value * value;
            across += x * value;
            down += y * value;
            places += x * x;
            brightest = std::max(brightest, value);
            ++n;
        }
    if (brightest >= TextureLevel::kSaturatedFrom || sum < TextureLevel::kDark * n)
        return std::nullopt;
    return (squares - (sum * sum) / n - (across * across + down * down) / places) / (n - 3);
}

// Whether enough windows stand out from noise of that variance.
bool shows_texture(const Image& image, double noise) {
    size_t windows = 0, textured = 0;
    for (size_t y = 0; y + kSide <= image.height; y += kSide)
        for (size_t x = 0; x + kSide <= image.width; x += kSide) {
            const std::optional<double> variance = variance_of(image, x, y);
            if (!variance) continue;
            ++windows;
            textured += (1 - TextureLevel::kMinZncc) * *variance >= noise ? 1 : 0;
        }
    return windows < TextureLevel::kFewestWindows ||
           static_cast<double>(textured) >= TextureLevel::kMinShare * static_cast<double>(windows);
}

}  // namespace

uint32_t texture_level(const uint8_t* gray, uint32_t width, uint32_t height) {
    if (width < kSide || height < kSide) return 0;
    Image image{{gray, gray + size_t{width} * height}, width, height};
    double noise = noise_variance(gray, width, height);
    if (noise > TextureLevel::kMostNoise * TextureLevel::kMostNoise) return 0;
    uint32_t level = 0;
    for (; level < TextureLevel::kMaxLevel && !shows_texture(image, noise); ++level) {
        image = halved(image);
        noise /= 4;
    }
    return level;
}

}  // namespace defrec
