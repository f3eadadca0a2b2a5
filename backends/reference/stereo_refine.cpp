// The sub-stages of stereo from the hypothesis to the result; those before are stereo_steps.cpp.
// docs/stages/stereo.md.
#include <algorithm>
#include <array>
#include <cstdlib>

#include "backends/reference/stereo_integer.hpp"
#include "backends/reference/stereo_steps.hpp"
#include "backends/stages/stereo.hpp"

namespace defrec::reference {
namespace {

// Sums of value(x, y) over windows cut off at the border.
template <class Value>
Picture<int64_t> window_sums(int w, int h, int radius, Value&& value) {
    Picture<int64_t> columns(w, h), result(w, h);
    for (int x = 0; x < w; ++x) {
        int64_t sum = 0;
        for (int y = -radius; y < h; ++y) {
            if (y + radius < h) sum += value(x, y + radius);
            if (y - radius - 1 >= 0) sum -= value(x, y - radius - 1);
            if (y >= 0) columns(x, y) = sum;
        }
    }
    for (int y = 0; y < h; ++y) {
        int64_t sum = 0;
        for (int x = -radius; x < w; ++x) {
            if (x + radius < w) sum += columns(x + radius, y);
            if (x - radius - 1 >= 0) sum -= columns(x - radius - 1, y);
            if (x >= 0) result(x, y) = sum;
        }
    }
    return result;
}

// The right image seen through the hypothesis, one pixel to the left, on the spot, and one to the
// right; half gray levels.
std::array<Picture<int16_t>, 3> warp(const Gray& right, const Disparities& hypothesis) {
    const int w = right.width, h = right.height;
    std::array<Picture<int16_t>, 3> result{Picture<int16_t>(w, h), Picture<int16_t>(w, h),
                                           Picture<int16_t>(w, h)};
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const int position = 16 * x - hypothesis(x, y), column = position >> 4,
                      part = position & 15;
            for (int k = 0; k < 3; ++k) {
                const int first = right.clamped(column + k - 1, y),
                          second = right.clamped(column + k, y);
                result[size_t(k)](x, y) = int16_t(((16 - part) * first + part * second + 4) >> 3);
            }
        }
    return result;
}

}  // namespace

Refinement refine(const Gray& left, const Gray& right, const Disparities& hypothesis, int radius) {
    const int w = left.width, h = left.height;
    const auto warped = warp(right, hypothesis);
    const auto left_sum = window_sums(w, h, radius, [&](int x, int y) { return left(x, y); });
    const auto left_squares =
        window_sums(w, h, radius, [&](int x, int y) { return left(x, y) * left(x, y); });
    std::vector<Picture<int64_t>> sum, squares, products;
    for (const Picture<int16_t>& image : warped) {
        sum.push_back(window_sums(w, h, radius, [&](int x, int y) { return image(x, y); }));
        squares.push_back(
            window_sums(w, h, radius, [&](int x, int y) { return image(x, y) * image(x, y); }));
        products.push_back(
            window_sums(w, h, radius, [&](int x, int y) { return left(x, y) * image(x, y); }));
    }
    const int samples_x = (w + 1) / 2, samples_y = (h + 1) / 2;
    Refinement result{Disparities(samples_x, samples_y), Picture<int16_t>(samples_x, samples_y),
                      Mask(samples_x, samples_y), Picture<int64_t>(samples_x, samples_y),
                      Picture<int32_t>(samples_x, samples_y)};
    for (int j = 0; j < samples_y; ++j)
        for (int i = 0; i < samples_x; ++i) {
            const int x = 2 * i, y = 2 * j;
            const int n = (std::min(x + radius, w - 1) - std::max(x - radius, 0) + 1) *
                          (std::min(y + radius, h - 1) - std::max(y - radius, 0) + 1);
            const int64_t s = left_sum(x, y);
            result.count(i, j) = n;
            result.variance(i, j) = n * left_squares(x, y) - s * s;
            const float left_inverse = inverse_root(result.variance(i, j)) * 0x1p20f;
            int z[3];
            for (size_t k = 0; k < 3; ++k) {
                const int64_t t = sum[k](x, y);
                const int64_t covariance = n * products[k](x, y) - s * t,
                              variance = n * squares[k](x, y) - t * t;
                z[k] = int((float(covariance) * inverse_root(variance)) * left_inverse);
            }
            result.score(i, j) = int16_t(std::max({z[0], z[1], z[2]}) >> 8);
            result.disparity(i, j) = hypothesis(x, y);
            const int bend = 2 * z[1] - z[0] - z[2];
            if (bend <= 0) continue;
            const int step = int(floor_divide(16 * (z[0] - z[2]) + bend, 2 * bend));
            result.peak(i, j) = std::abs(step) <= 16;
            result.disparity(i, j) =
                int16_t(std::clamp(hypothesis(x, y) + std::clamp(step, -16, 16), 0, kMaxDisparity));
        }
    return result;
}

Disparities between_samples(const Disparities& samples, int width, int height) {
    Disparities result(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int u = x / 2, v = y / 2, u2 = (x + 1) / 2, v2 = (y + 1) / 2;
            result(x, y) = int16_t((samples(u, v) + samples.clamped(u2, v) +
                                    samples.clamped(u, v2) + samples.clamped(u2, v2) + 2) >>
                                   2);
        }
    return result;
}

Disparities hypothesis_of(const Disparities& half_samples, int width, int height) {
    Disparities result(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int u = x / 4, v = y / 4, u2 = x % 4 == 0 ? u - 1 : u + 1,
                      v2 = y % 4 == 0 ? v - 1 : v + 1;
            const int p = kSampleWeight[x % 4], q = kSampleWeight[y % 4];
            const int a = half_samples.clamped(u, v), b = half_samples.clamped(u2, v),
                      c = half_samples.clamped(u, v2), d = half_samples.clamped(u2, v2);
            if (std::max({a, b, c, d}) - std::min({a, b, c, d}) <= kUpsampleRange) {
                const int change =
                    (8 - p) * q * (b - a) + p * (8 - q) * (c - a) + (8 - p) * (8 - q) * (d - a);
                result(x, y) = int16_t(2 * a + ((change + 16) >> 5));
            } else if (q >= 4) {
                result(x, y) = int16_t(2 * (p >= 4 ? a : b));
            } else {
                result(x, y) = int16_t(2 * (p >= 4 ? c : d));
            }
        }
    return result;
}

Evidence classify(const Refinement& refined, const Disparities& hypothesis,
                  const Picture<uint8_t>& standing_half, const Mask& left_mask,
                  const Mask& right_mask, const StereoConstants& c) {
    Evidence result{Disparities(c.samples_x, c.samples_y, kNoDisparity),
                    Picture<uint8_t>(c.samples_x, c.samples_y)};
    for (int j = 0; j < c.samples_y; ++j)
        for (int i = 0; i < c.samples_x; ++i) {
            const int x = 2 * i, y = 2 * j;
            if (!left_mask(x, y)) continue;
            const uint8_t stands = standing_half(std::min(i, c.half_width - 1) / 2,
                                                 std::min(j, c.half_height - 1) / 2);
            if (stands == kDoubtful) continue;
            const bool known = stands == kSettled;
            const int score = refined.score(i, j), position = 16 * x - refined.disparity(i, j);
            const int64_t n = refined.count(i, j);
            const bool good =
                refined.peak(i, j) && position >= 0 && right_mask.clamped((position + 8) >> 4, y) &&
                score >= (known ? kTrustedScore : c.refine_score) &&
                kTextureOne2 * refined.variance(i, j) >= int64_t{c.texture} * c.texture * n * n;
            if (!good && !known) continue;
            result.disparity(i, j) = good ? refined.disparity(i, j) : hypothesis(x, y);
            result.confidence(i, j) = uint8_t(std::clamp(good ? score >> 4 : score >> 5, 1, 255));
        }
    return result;
}

void drop_speckles(Evidence& evidence, const StereoConstants& c) {
    const int w = evidence.disparity.width, h = evidence.disparity.height;
    const auto count = window_sums(w, h, kSpeckleRadius, [&](int x, int y) {
        return evidence.disparity(x, y) != kNoDisparity;
    });
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
            if (count(x, y) < c.support) {
                evidence.disparity(x, y) = kNoDisparity;
                evidence.confidence(x, y) = 0;
            }
}

void fill_small(Evidence& evidence, const Disparities& hypothesis, const StereoConstants& c) {
    const int radius = c.fill_radius;
    const int w = c.samples_x, h = c.samples_y, side = 2 * radius + 1;
    const Disparities before = evidence.disparity;
    const auto known = [&](int x, int y) { return before(x, y) != kNoDisparity; };
    const auto count = window_sums(w, h, radius, known);
    const auto sum = window_sums(w, h, radius, [&](int x, int y) {
        return known(x, y) ? before(x, y) - hypothesis(2 * x, 2 * y) : 0;
    });
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const int64_t n = count(x, y);
            if (known(x, y) || 2 * n < side * side) continue;
            evidence.disparity(x, y) = int16_t(std::max<int64_t>(
                0, hypothesis(2 * x, 2 * y) + floor_divide(2 * sum(x, y) + n, 2 * n)));
            evidence.confidence(x, y) = kFilledConfidence;
        }
}

Evidence at_all_pixels(const Evidence& samples, const StereoConstants& c) {
    Evidence result{Disparities(c.width, c.height, kNoDisparity),
                    Picture<uint8_t>(c.width, c.height)};
    const Disparities& field = samples.disparity;
    for (int y = 0; y < c.height; ++y)
        for (int x = 0; x < c.width; ++x) {
            const int u = x / 2, v = y / 2, u2 = (x + 1) / 2, v2 = (y + 1) / 2;
            result.confidence(x, y) = samples.confidence(u, v);
            const int a = field(u, v);
            if (a == kNoDisparity) continue;
            int sum = 0, count = 0;
            for (const int other : {a, int(field.clamped(u2, v)), int(field.clamped(u, v2)),
                                    int(field.clamped(u2, v2))}) {
                if (other == kNoDisparity || std::abs(other - a) > c.smooth_range) continue;
                sum += other - a;
                ++count;
            }
            result.disparity(x, y) = int16_t(a + floor_divide(2 * sum + count, 2 * count));
        }
    return result;
}

}  // namespace defrec::reference
