// The sub-stages of stereo up to the hypothesis; the rest is stereo_refine.cpp.
// docs/stages/stereo.md.
#include "backends/reference/stereo_steps.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "backends/reference/stereo_integer.hpp"
#include "backends/stages/stereo.hpp"

namespace defrec::reference {

Gray inpaint(const Gray& gray, const Mask& mask) {
    Gray result = gray;
    for (int y = 0; y < gray.height; ++y)
        for (int x = 0; x < gray.width; ++x) {
            if (mask(x, y)) continue;
            int sum = 0, count = 0;
            for (int v = y - kInpaintRadius; v <= y + kInpaintRadius; ++v)
                for (int u = x - kInpaintRadius; u <= x + kInpaintRadius; ++u)
                    if (mask.contains(u, v) && mask(u, v)) {
                        sum += gray(u, v);
                        ++count;
                    }
            result(x, y) = count == 0 ? 128 : uint8_t((2 * sum + count) / (2 * count));
        }
    return result;
}

Gray halve(const Gray& gray) {
    Gray result(gray.width / 2, gray.height / 2);
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < result.width; ++x)
            result(x, y) = uint8_t((gray(2 * x, 2 * y) + gray(2 * x + 1, 2 * y) +
                                    gray(2 * x, 2 * y + 1) + gray(2 * x + 1, 2 * y + 1) + 2) >>
                                   2);
    return result;
}

Mask halve_mask(const Mask& mask) {
    Mask result(mask.width / 2, mask.height / 2);
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < result.width; ++x)
            result(x, y) = mask(2 * x, 2 * y) && mask(2 * x + 1, 2 * y) && mask(2 * x, 2 * y + 1) &&
                           mask(2 * x + 1, 2 * y + 1);
    return result;
}

WindowStatistics statistics(const Gray& gray, int radius) {
    const int w = gray.width, h = gray.height, n = (2 * radius + 1) * (2 * radius + 1);
    WindowStatistics result{Picture<int32_t>(w, h), Picture<int32_t>(w, h), Picture<float>(w, h)};
    for (int y = radius; y < h - radius; ++y)
        for (int x = radius; x < w - radius; ++x) {
            int sum = 0, squares = 0;
            for (int v = -radius; v <= radius; ++v)
                for (int u = -radius; u <= radius; ++u) {
                    const int value = gray(x + u, y + v) - 128;
                    sum += value;
                    squares += value * value;
                }
            result.sum(x, y) = sum;
            result.variance(x, y) = n * squares - sum * sum;
            result.inverse(x, y) = inverse_root(result.variance(x, y));
        }
    return result;
}

SearchResult search(const Gray& left, const Gray& right, const WindowStatistics& left_stats,
                    const WindowStatistics& right_stats, const StereoConstants& c) {
    const int radius = c.radius, first = c.first, count = c.count;
    const int w = left.width, h = left.height, side = 2 * radius + 1,
              groups = (count + kGroup - 1) / kGroup;
    const float one_over_n = 1.0f / float(side * side);
    SearchResult result{Picture<int32_t>(c.half_samples_x, c.half_samples_y),
                        Picture<int32_t>(w, c.half_samples_y),
                        Picture<int32_t>(c.half_samples_x, c.half_samples_y)};
    std::vector<int> columns(
        size_t(w) * size_t(count));  // products of one column of the window, for each disparity
    for (int y = radius; y < h - radius; ++y) {
        Picture<int32_t> best(c.half_samples_x, groups);
        for (int index = 0; index < count; ++index) {
            const int d = first + index;
            int* column = columns.data() + size_t(index) * size_t(w);
            const auto product = [&](int x, int v) {
                return (left(x, v) - 128) * (right(x - d, v) - 128);
            };
            for (int x = d; x < w; ++x) {
                if (y == radius)
                    for (int v = 0; v < side; ++v) column[x] += product(x, v);
                else
                    column[x] += product(x, y + radius) - product(x, y - radius - 1);
            }
            if (y % 2 != 0) continue;
            for (int x = (d + radius + 1) / 2 * 2; x < w - radius; x += 2) {
                int sum = 0;
                for (int u = -radius; u <= radius; ++u) sum += column[x + u];
                const float mean = float(left_stats.sum(x, y)) * one_over_n;
                const float expected = mean * float(right_stats.sum(x - d, y));
                const float covariance = float(sum) - expected;
                const float score =
                    covariance * (left_stats.inverse(x, y) * right_stats.inverse(x - d, y));
                if (!(score > 0)) continue;
                const int key = (std::bit_cast<int>(score) & ~0xff) | index;
                int &left_best = best(x / 2, index / kGroup),
                    &right_best = result.right(x - d, y / 2);
                left_best = std::max(left_best, key);
                right_best = std::max(right_best, key);
            }
        }
        for (int i = 0; y % 2 == 0 && i < c.half_samples_x; ++i) {
            int &winner = result.left(i, y / 2), &second = result.second(i, y / 2);
            for (int g = 0; g < groups; ++g) winner = std::max(winner, best(i, g));
            for (int g = 0; g < groups; ++g)
                if (std::abs(g - (winner & 255) / kGroup) > 1)
                    second = std::max(second, best(i, g));
        }
    }
    return result;
}

Disparities check(const SearchResult& found, const WindowStatistics& left_stats,
                  const Mask& left_mask, const Mask& right_mask, const StereoConstants& c) {
    const int n = (2 * c.radius + 1) * (2 * c.radius + 1);
    const auto score = [](int key) { return std::bit_cast<float>(key & ~0xff); };
    Disparities result(c.half_samples_x, c.half_samples_y, kNoDisparity);
    for (int j = 0; j < c.half_samples_y; ++j)
        for (int i = 0; i < c.half_samples_x; ++i) {
            const int x = 2 * i, y = 2 * j, key = found.left(i, j);
            if (key == 0 || !left_mask(x, y) || score(key) < c.min_score) continue;
            if (score(key) - score(found.second(i, j)) < c.min_lead) continue;
            if (int64_t{kTextureOne2} * left_stats.variance(x, y) <
                int64_t{c.texture} * c.texture * n * n)
                continue;
            const int d = c.first + (key & 255);
            if (!right_mask(x - d, y)) continue;
            if (std::abs((found.right(x - d, j) & 255) - (key & 255)) > c.left_right) continue;
            result(i, j) = int16_t(16 * d);
        }
    return result;
}

Disparities supported(const Disparities& disparities, const StereoConstants& c) {
    Disparities result = disparities;
    for (int y = 0; y < disparities.height; ++y)
        for (int x = 0; x < disparities.width; ++x) {
            const int d = disparities(x, y);
            if (d == kNoDisparity) continue;
            int agreeing = 0;
            for (int v = y - kSupportRadius; v <= y + kSupportRadius; ++v)
                for (int u = x - kSupportRadius; u <= x + kSupportRadius; ++u)
                    if (disparities.contains(u, v) && disparities(u, v) != kNoDisparity &&
                        std::abs(disparities(u, v) - d) <= kSupportRange)
                        ++agreeing;
            if (agreeing < c.support) result(x, y) = kNoDisparity;
        }
    return result;
}

namespace {

Disparities smooth_along(const Disparities& disparities, int radius, int range, int step_x,
                         int step_y) {
    Disparities result = disparities;
    for (int y = 0; y < disparities.height; ++y)
        for (int x = 0; x < disparities.width; ++x) {
            const int d = disparities(x, y);
            if (d == kNoDisparity) continue;
            int sum = 0, count = 0;
            for (int k = -radius; k <= radius; ++k) {
                const int u = x + k * step_x, v = y + k * step_y;
                if (!disparities.contains(u, v) || disparities(u, v) == kNoDisparity) continue;
                const int difference = disparities(u, v) - d;
                if (std::abs(difference) > range) continue;
                sum += difference;
                ++count;
            }
            result(x, y) = int16_t(d + ((sum * kReciprocal[count] + (1 << 14)) >> 15));
        }
    return result;
}

}  // namespace

Disparities smooth(const Disparities& disparities, int radius, int range) {
    return smooth_along(smooth_along(disparities, radius, range, 1, 0), radius, range, 0, 1);
}

bool is_empty(const Disparities& disparities) {
    return std::all_of(disparities.pixels.begin(), disparities.pixels.end(),
                       [](int d) { return d == kNoDisparity; });
}

Disparities fill_all(const Disparities& disparities) {
    const int w = disparities.width, h = disparities.height;
    const auto none = [](int d) { return d == kNoDisparity; };
    if (is_empty(disparities) ||
        std::none_of(disparities.pixels.begin(), disparities.pixels.end(), none))
        return disparities;
    Disparities coarse((w + 1) / 2, (h + 1) / 2, kNoDisparity);
    for (int y = 0; y < coarse.height; ++y)
        for (int x = 0; x < coarse.width; ++x) {
            int sum = 0, count = 0;
            for (int k = 0; k < 4; ++k) {
                const int u = 2 * x + k % 2, v = 2 * y + k / 2;
                if (!disparities.contains(u, v) || none(disparities(u, v))) continue;
                sum += disparities(u, v);
                ++count;
            }
            if (count > 0) coarse(x, y) = int16_t(floor_divide(2 * sum + count, 2 * count));
        }
    coarse = fill_all(coarse);
    Disparities result = disparities;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            if (!none(disparities(x, y))) continue;
            const int u = x / 2, v = y / 2, u2 = x % 2 == 0 ? u - 1 : u + 1,
                      v2 = y % 2 == 0 ? v - 1 : v + 1;
            result(x, y) = int16_t((9 * coarse(u, v) + 3 * coarse.clamped(u2, v) +
                                    3 * coarse.clamped(u, v2) + coarse.clamped(u2, v2) + 8) >>
                                   4);
        }
    return result;
}

Picture<uint8_t> standing(const Disparities& supported_disparities, const Disparities& dense,
                          const StereoConstants& c) {
    Picture<uint8_t> result(dense.width, dense.height);
    for (int y = 0; y < dense.height; ++y)
        for (int x = 0; x < dense.width; ++x) {
            int minimum = dense(x, y), maximum = minimum;
            for (int v = y - kEdgeRadius; v <= y + kEdgeRadius; ++v)
                for (int u = x - kEdgeRadius; u <= x + kEdgeRadius; ++u) {
                    minimum = std::min<int>(minimum, dense.clamped(u, v));
                    maximum = std::max<int>(maximum, dense.clamped(u, v));
                }
            if (dense(x, y) - minimum > c.edge)
                result(x, y) = kDoubtful;
            else if (maximum - minimum > c.edge || supported_disparities(x, y) == kNoDisparity)
                result(x, y) = kOpen;
            else
                result(x, y) = kSettled;
        }
    return result;
}

}  // namespace defrec::reference
