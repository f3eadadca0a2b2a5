// See check_patches.hpp.
#include "sdk/template/check_patches.hpp"

#include <algorithm>

#include "sdk/template/cut.hpp"
#include "sdk/template/surface_point.hpp"
#include "sdk/template/texture.hpp"

namespace defrec {
namespace {

using decisions::CheckPatches;

// Texture of the patch's window, on the image of the check's level; 0 where the window leaves the
// image.
double window_texture(const TemplateData& data, const uint8_t* image, double u, double v) {
    const int width = static_cast<int>(data.width), height = static_cast<int>(data.height),
              step = 1 << check_level(data), radius = static_cast<int>(CheckPatches::kCheckRadius);
    const int x0 = static_cast<int>(u) - radius * step, y0 = static_cast<int>(v) - radius * step;
    const int reach = (2 * radius + 2) * step;
    if (x0 < step || y0 < step || x0 + reach >= width || y0 + reach >= height) return 0;
    const auto gray = [&](int x, int y) {
        int sum = 0;
        for (int dy = 0; dy < step; ++dy)
            for (int dx = 0; dx < step; ++dx) sum += image[(y + dy) * width + x + dx];
        return static_cast<double>(sum) / (step * step);
    };
    return texture(gray, static_cast<int>(u), static_cast<int>(v), radius, step);
}

}  // namespace

// Noise has a quarter of its variance on the next level.
bool has_check_texture(const TemplateData& data, const uint8_t* gray, double u, double v) {
    const uint32_t higher = check_level(data) - fine_check_level(data.width);
    return window_texture(data, gray, u, v) >=
           CheckPatches::kMinCheckTexture / static_cast<double>(1u << (2 * higher));
}

void place_checks(TemplateData& data) {
    const SurfaceGrid& grid = data.grid;
    const double window = (2 * CheckPatches::kCheckRadius + 1) << check_level(data);
    // Two vertices a side at least, where both lie in the window: at one each, the windows of large
    // images would cover each pixel several times.
    const int least = grid.spacing <= window ? 2 : 1;
    const int step = std::max(least, static_cast<int>(window / grid.spacing));
    data.checks.clear();
    data.check_of_vertex.assign(data.vertices.size(), -1);
    for (int y0 = 0; y0 < grid.rows; y0 += step)
        for (int x0 = 0; x0 < grid.columns; x0 += step) {
            const double u = (x0 + 0.5 * (step - 1)) * grid.spacing,
                         v = (y0 + 0.5 * (step - 1)) * grid.spacing;
            defrec_patch patch{};
            if (!has_check_texture(data, data.image.data(), u, v) ||
                !surface_patch(data, u, v, patch))
                continue;
            const auto index = static_cast<int32_t>(data.checks.size());
            data.checks.push_back(patch);
            for (int y = y0; y < std::min(y0 + step, grid.rows); ++y)
                for (int x = x0; x < std::min(x0 + step, grid.columns); ++x)
                    if (const int32_t vertex =
                            grid.vertex[static_cast<size_t>(y * grid.columns + x)];
                        vertex >= 0 && data.piece_of(data.vertices[static_cast<size_t>(vertex)]) ==
                                           data.piece_of(patch))
                        data.check_of_vertex[static_cast<size_t>(vertex)] = index;
        }
    forget_checks_at_cuts(data);
}

void forget_checks_at_cuts(TemplateData& data) {
    if (data.node_grid.cuts.empty()) return;
    const double radius = CheckPatches::kCheckRadius << check_level(data);
    const size_t first = std::min<size_t>(data.first_counts().checks, data.checks.size());
    std::vector<uint8_t> is_crossed(data.checks.size(), 0);
    for (size_t i = 0; i < first; ++i)
        is_crossed[i] = distance_to_cut(data.node_grid.cuts, data.piece_of(data.checks[i]),
                                        {data.checks[i].u, data.checks[i].v}) < radius;
    for (int32_t& check : data.check_of_vertex)
        if (check >= 0 && is_crossed[static_cast<size_t>(check)] != 0) check = -1;
}

}  // namespace defrec
