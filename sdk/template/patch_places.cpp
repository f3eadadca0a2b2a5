// See patch_places.hpp.
#include "sdk/template/patch_places.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/template/decisions.hpp"
#include "sdk/template/texture.hpp"

namespace defrec {
namespace {

using decisions::PatchPlaces;

double trackability(const CaptureInput& input, int cx, int cy) {
    const auto gray = [&](int x, int y) {
        return int{input.gray[static_cast<size_t>(y) * input.width + static_cast<size_t>(x)]};
    };
    return texture(gray, cx, cy, PatchPlaces::kWindowRadius);
}

bool masked_near(const CaptureInput& input, int cx, int cy, int radius) {
    for (int y = cy - radius; y <= cy + radius; y += PatchPlaces::kPixelStep)
        for (int x = cx - radius; x <= cx + radius; x += PatchPlaces::kPixelStep)
            if (input.mask != nullptr &&
                input.mask[static_cast<size_t>(y) * input.width + static_cast<size_t>(x)] == 0)
                return true;
    return false;
}

}  // namespace

double patch_cell(const CaptureInput& input) {
    return std::max(PatchPlaces::kMinPatchCell,
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
            double best = PatchPlaces::kMinTrackability;
            PatchPlace at{-1, -1};
            for (int y = y0; y < y1; y += PatchPlaces::kPixelStep)
                for (int x = x0; x < x1; x += PatchPlaces::kPixelStep) {
                    const double score = trackability(input, x, y);
                    if (score <= best || masked_near(input, x, y, PatchPlaces::kMaskReach) ||
                        !is_wanted(x, y))
                        continue;
                    best = score;
                    at = {x, y};
                }
            if (at.u >= 0) places.push_back(at);
        }
    return places;
}

}  // namespace defrec
