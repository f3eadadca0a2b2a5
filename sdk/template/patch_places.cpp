// See patch_places.hpp.
#include "sdk/template/patch_places.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/template/texture.hpp"

namespace defrec {
namespace {

constexpr double kMinTrackability = 0.15;

double trackability(const CaptureInput& input, int cx, int cy) {
    constexpr int kRadius = 4;
    const auto gray = [&](int x, int y) {
        return int{input.gray[static_cast<size_t>(y) * input.width + static_cast<size_t>(x)]};
    };
    return texture(gray, cx, cy, kRadius);
}

bool masked_near(const CaptureInput& input, int cx, int cy, int radius) {
    for (int y = cy - radius; y <= cy + radius; y += 2)
        for (int x = cx - radius; x <= cx + radius; x += 2)
            if (input.mask != nullptr &&
                input.mask[static_cast<size_t>(y) * input.width + static_cast<size_t>(x)] == 0)
                return true;
    return false;
}

}  // namespace

double patch_cell(const CaptureInput& input) {
    return std::max(12.0,
                    std::sqrt(static_cast<double>(input.width) * input.height / input.max_patches));
}

std::vector<PatchPlace> trackable_places(const CaptureInput& input, double cell, int border,
                                         const std::function<bool(int u, int v)>& is_wanted) {
    std::vector<PatchPlace> places;
    const int columns = static_cast<int>(input.width / cell),
              rows = static_cast<int>(input.height / cell);
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const int x0 = std::max(border, static_cast<int>(column * cell)),
                      x1 = std::min(static_cast<int>(input.width) - border,
                                    static_cast<int>((column + 1) * cell));
            const int y0 = std::max(border, static_cast<int>(row * cell)),
                      y1 = std::min(static_cast<int>(input.height) - border,
                                    static_cast<int>((row + 1) * cell));
            double best = kMinTrackability;
            PatchPlace at{-1, -1};
            for (int y = y0; y < y1; y += 2)
                for (int x = x0; x < x1; x += 2) {
                    const double score = trackability(input, x, y);
                    if (score <= best || masked_near(input, x, y, 5) || !is_wanted(x, y)) continue;
                    best = score;
                    at = {x, y};
                }
            if (at.u >= 0) places.push_back(at);
        }
    return places;
}

}  // namespace defrec
