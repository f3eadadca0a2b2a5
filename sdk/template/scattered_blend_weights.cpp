// See scattered_blend_weights.hpp.
#include "sdk/template/scattered_blend_weights.hpp"

#include <array>
#include <limits>

#include "backends/shared/motion.hpp"
#include "sdk/template/decisions.hpp"

namespace defrec {
namespace {

using decisions::PointWeights;

struct Near {
    int32_t index;
    double x, y, squared;  // from the pixel
};

// Twice the area of the triangle of the origin, a and b.
double area(const Near& a, const Near& b) { return a.x * b.y - a.y * b.x; }

bool set_blend_weights(BlendWeights& blend_weights,
                       std::initializer_list<std::pair<int32_t, double>> entries) {
    blend_weights = BlendWeights{};
    blend_weights.node.fill(entries.begin()->first);
    size_t k = 0;
    for (const auto& [node, weight] : entries) {
        blend_weights.node[k] = node;
        blend_weights.weight[k++] = static_cast<float>(weight);
    }
    return true;
}

// The point of the line from a to b that is nearest to the origin, as a share of the way.
double nearest_on(const Near& a, const Near& b, double& squared) {
    const double dx = b.x - a.x, dy = b.y - a.y, length = dx * dx + dy * dy;
    const double t = length > 0 ? std::clamp(-(a.x * dx + a.y * dy) / length, 0.0, 1.0) : 0;
    const double x = a.x + t * dx, y = a.y + t * dy;
    squared = x * x + y * y;
    return t;
}

}  // namespace

bool scattered_blend_weights(const PixelBuckets& nodes, double spacing, double u, double v,
                             BlendWeights& blend_weights) {
    std::vector<Near> near;
    nodes.near(u, v, PointWeights::kReach * spacing, [&](const PixelPoint& point, double squared) {
        near.push_back({point.index, point.u - u, point.v - v, squared});
    });
    if (near.size() < 2) return false;
    std::sort(near.begin(), near.end(), [](const Near& a, const Near& b) {
        return a.squared != b.squared ? a.squared < b.squared : a.index < b.index;
    });
    if (near.size() > PointWeights::kNearest) near.resize(PointWeights::kNearest);

    // The Delaunay triangle is the one round the pixel in which the squared distance from the
    // pixel, interpolated linearly, is least at the pixel.
    double least = std::numeric_limits<double>::infinity();
    const double smallest = PointWeights::kMinArea * spacing * spacing;
    for (size_t a = 0; a < near.size(); ++a)
        for (size_t b = a + 1; b < near.size(); ++b)
            for (size_t c = b + 1; c < near.size(); ++c) {
                const double wa = area(near[b], near[c]), wb = area(near[c], near[a]),
                             wc = area(near[a], near[b]), sum = wa + wb + wc;
                if (std::abs(sum) < smallest) continue;
                const double ka = wa / sum, kb = wb / sum, kc = wc / sum;
                if (std::min({ka, kb, kc}) < -1e-9) continue;
                const double value =
                    ka * near[a].squared + kb * near[b].squared + kc * near[c].squared;
                if (value >= least) continue;
                least = value;
                set_blend_weights(blend_weights, {{near[a].index, std::max(0.0, ka)},
                                                  {near[b].index, std::max(0.0, kb)},
                                                  {near[c].index, std::max(0.0, kc)}});
            }
    if (least < std::numeric_limits<double>::infinity()) return true;

    for (size_t a = 0; a < near.size(); ++a)
        for (size_t b = a + 1; b < near.size(); ++b) {
            double squared = 0;
            const double t = nearest_on(near[a], near[b], squared);
            if (squared >= least) continue;
            least = squared;
            set_blend_weights(blend_weights, {{near[a].index, 1 - t}, {near[b].index, t}});
        }
    return true;
}

defrec_patch_slope scattered_slope(std::span<const float> nodes, const defrec_patch& patch) {
    const auto corner = [&](int k) {
        return load3<double>(&nodes[3 * static_cast<size_t>(patch.node[k])]);
    };
    const Vec3<double> a = corner(1) - corner(0), b = corner(2) - corner(0);
    const double aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), determinant = aa * bb - ab * ab;
    defrec_patch_slope slope{};
    if (!(determinant > PointWeights::kThin * aa * bb)) return slope;
    const auto along = [&](const float tangent[3], float weights[DEFREC_BLEND_NODES]) {
        const Vec3<double> t = load3<double>(tangent);
        const double at = dot(a, t), bt = dot(b, t);
        weights[1] = static_cast<float>((bb * at - ab * bt) / determinant);
        weights[2] = static_cast<float>((aa * bt - ab * at) / determinant);
        weights[0] = -weights[1] - weights[2];
    };
    along(patch.tangent_u, slope.weight_u);
    along(patch.tangent_v, slope.weight_v);
    return slope;
}

}  // namespace defrec
