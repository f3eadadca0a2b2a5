// See coarse_search.hpp.
#include "sdk/tracking/stages/coarse_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "sdk/tracking/decisions/disparity.hpp"

namespace defrec {
namespace {

using Decision = decisions::CoarseSearch;

constexpr int kRadius = Decision::kRadius;

uint32_t scale_for(uint32_t width) {
    uint32_t scale = 1;
    while (width / (2 * scale) >= Decision::kMinWidth) scale *= 2;
    return scale;
}

// Means of scale x scale pixels, the usable ones; negative where hardly any is.
struct SmallImage {
    int width, height;
    std::vector<float> gray;

    SmallImage(const RectifiedViews& views, int view, uint32_t scale)
        : width(static_cast<int>(views.width / scale)),
          height(static_cast<int>(views.height / scale)),
          gray(static_cast<size_t>(width) * static_cast<size_t>(height)) {
        for (size_t y = 0; y < static_cast<size_t>(height); ++y)
            for (size_t x = 0; x < static_cast<size_t>(width); ++x) {
                uint32_t sum = 0, count = 0;
                for (size_t row = scale * y; row < scale * (y + 1); ++row)
                    for (size_t at = row * views.width + scale * x, end = at + scale; at < end;
                         ++at) {
                        if (views.mask[view][at] == 0) continue;
                        sum += views.gray[view][at];
                        ++count;
                    }
                gray[y * static_cast<size_t>(width) + x] =
                    2 * count >= scale * scale ? static_cast<float>(sum) / static_cast<float>(count)
                                               : -1.f;
            }
    }
};

// The window about a pixel, less its mean and of length 1.
using Window = std::array<float, (2 * kRadius + 1) * (2 * kRadius + 1)>;

// false: it holds masked pixels or too little contrast.
bool window_at(const SmallImage& image, int x, int y, Window& window) {
    float sum = 0;
    size_t i = 0;
    for (int row = y - kRadius; row <= y + kRadius; ++row)
        for (int column = x - kRadius; column <= x + kRadius; ++column) {
            const float gray =
                image.gray[static_cast<size_t>(row) * static_cast<size_t>(image.width) +
                           static_cast<size_t>(column)];
            if (gray < 0) return false;
            sum += window[i++] = gray;
        }
    constexpr auto kCount = static_cast<float>(Window().size());
    float squares = 0;
    for (float& value : window) {
        value -= sum / kCount;
        squares += value * value;
    }
    if (squares < kCount * Decision::kMinDeviation * Decision::kMinDeviation) return false;
    for (float& value : window) value /= std::sqrt(squares);
    return true;
}

// The windows of a row of an image; those that are of no use are marked so.
struct WindowRow {
    std::vector<Window> windows;
    std::vector<uint8_t> is_usable;

    WindowRow(const SmallImage& image, int y)
        : windows(static_cast<size_t>(image.width)), is_usable(windows.size()) {
        for (int x = kRadius; x + kRadius < image.width; ++x)
            is_usable[static_cast<size_t>(x)] =
                window_at(image, x, y, windows[static_cast<size_t>(x)]);
    }
};

// The best match of window x of `row` among those of `other` whose disparity is 0 to `max`; sign:
// -1 from left to right, 1 back. Negative where none is much better than all but its neighbours.
int best_disparity(const WindowRow& row, size_t x, const WindowRow& other, int max, int sign,
                   std::vector<float>& scores) {
    scores.assign(static_cast<size_t>(max) + 1, -1.f);
    const auto width = static_cast<int>(row.windows.size());
    for (int d = 0; d <= max; ++d) {
        const int to = static_cast<int>(x) + sign * d;
        if (to < 0 || to >= width) break;
        if (other.is_usable[static_cast<size_t>(to)] == 0) continue;
        const Window &a = row.windows[x], &b = other.windows[static_cast<size_t>(to)];
        float score = 0;
        for (size_t i = 0; i < a.size(); ++i) score += a[i] * b[i];
        scores[static_cast<size_t>(d)] = score;
    }
    const auto best = std::max_element(scores.begin(), scores.end());
    if (*best < Decision::kMinScore) return -1;
    for (auto score = scores.begin(); score != scores.end(); ++score)
        if (std::abs(score - best) > 1 && *score > *best - Decision::kMinLead) return -1;
    return static_cast<int>(best - scores.begin());
}

}  // namespace

std::optional<SeenDisparities> coarse_search(const RectifiedViews& views, uint32_t max_disparity) {
    const uint32_t scale = scale_for(views.width);
    const SmallImage left(views, 0, scale), right(views, 1, scale);
    const int max = static_cast<int>(max_disparity / scale);
    std::vector<double> found;
    size_t tried = 0;
    std::vector<float> scores;
    for (int y = kRadius; y + kRadius < left.height; y += 2) {
        const WindowRow in_left(left, y), in_right(right, y);
        for (size_t x = 0; x < in_left.windows.size(); x += 2) {
            ++tried;
            if (in_left.is_usable[x] == 0) continue;
            const int d = best_disparity(in_left, x, in_right, max, -1, scores);
            if (d < 0) continue;
            const int back =
                best_disparity(in_right, x - static_cast<size_t>(d), in_left, max, 1, scores);
            if (back >= 0 && std::abs(back - d) <= 1) found.push_back(d);
        }
    }
    const auto count = static_cast<double>(found.size());
    if (found.empty() || count < Decision::kMinShare * static_cast<double>(tried)) return {};
    std::sort(found.begin(), found.end());
    const auto outermost = static_cast<size_t>(Decision::kOutermost * count);
    return SeenDisparities{scale * found[outermost],
                           scale * (found[found.size() - 1 - outermost] + 1)};
}

}  // namespace defrec
