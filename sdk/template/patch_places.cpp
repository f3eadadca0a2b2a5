// See patch_places.hpp.
#include "sdk/template/patch_places.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/template/decisions.hpp"
#include "sdk/template/texture.hpp"

namespace defrec {
namespace {

using decisions::PatchPlaces;

// The image at the level on which its texture stands out. Its pixels are sums of those of the
// image.
class LevelImage {
  public:
    explicit LevelImage(const CaptureInput& input)
        : level_(input.texture_level),
          width_(static_cast<int>(input.width >> level_)),
          height_(static_cast<int>(input.height >> level_)) {
        const int side = 1 << level_;
        sums_.reserve(static_cast<size_t>(width_) * static_cast<size_t>(height_));
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                uint32_t sum = 0;
                for (int dy = 0; dy < side; ++dy)
                    for (int dx = 0; dx < side; ++dx)
                        sum += input.gray[static_cast<size_t>(y * side + dy) * input.width +
                                          static_cast<size_t>(x * side + dx)];
                sums_.push_back(static_cast<uint16_t>(sum));
            }
    }

    // How well the window round a pixel of the image can be found again, in proportion to the noise
    // as on level 0; 0 where the window leaves the image.
    double trackability(int u, int v) const {
        constexpr int kReach = PatchPlaces::kWindowRadius + 1;
        const int cx = u >> level_, cy = v >> level_;
        if (cx < kReach || cy < kReach || cx + kReach >= width_ || cy + kReach >= height_) return 0;
        const auto gray = [&](int x, int y) {
            return int{sums_[static_cast<size_t>(y) * static_cast<size_t>(width_) +
                             static_cast<size_t>(x)]};
        };
        return texture(gray, cx, cy, PatchPlaces::kWindowRadius) /
               static_cast<double>(1u << (2 * level_));
    }

  private:
    const uint32_t level_;
    const int width_, height_;
    std::vector<uint16_t> sums_;
};

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
    const LevelImage image(input);
    const int step = std::max(PatchPlaces::kPixelStep, 1 << input.texture_level),
              mask_reach = PatchPlaces::kMaskReach << input.texture_level;
    border = std::max(border, PatchPlaces::kBorder << input.texture_level);
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
            for (int y = y0; y < y1; y += step)
                for (int x = x0; x < x1; x += step) {
                    const double score = image.trackability(x, y);
                    if (score <= best || masked_near(input, x, y, mask_reach) || !is_wanted(x, y))
                        continue;
                    best = score;
                    at = {x, y};
                }
            if (at.u >= 0) places.push_back(at);
        }
    return places;
}

}  // namespace defrec
