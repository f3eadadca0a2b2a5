// Interpolation between the nodes of a regular grid that is smooth: Catmull and Rom's cubic.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace defrec::cli {

/// Weights of the nodes before, at, after and after next, at a share 0..1 of the way.
inline std::array<double, 4> cubic_weights(double x) {
    return {0.5 * x * (-1 + x * (2 - x)), 1 + 0.5 * x * x * (-5 + 3 * x),
            0.5 * x * (1 + x * (4 - 3 * x)), 0.5 * x * x * (x - 1)};
}

/// Four neighbouring nodes of a grid and their weights at a place.
struct CubicNodes {
    std::size_t first;
    std::array<double, 4> weights;
};

/// `place` counts in nodes, of which there are 4 or more; beyond them values go straight on.
inline CubicNodes cubic_nodes(double place, std::size_t nodes) {
    const auto last = static_cast<std::ptrdiff_t>(nodes) - 1;
    const auto before = static_cast<std::ptrdiff_t>(std::floor(place));
    const auto first = std::min(std::max<std::ptrdiff_t>(before - 1, 0), last - 3);
    CubicNodes result{static_cast<std::size_t>(first), {}};
    const auto weights = cubic_weights(place - static_cast<double>(before));
    for (std::ptrdiff_t i = 0; i < 4; ++i) {
        const std::ptrdiff_t node = before - 1 + i;
        const double weight = weights[static_cast<std::size_t>(i)];
        const auto add = [&](std::ptrdiff_t to, double share) {
            result.weights[static_cast<std::size_t>(to - first)] += share * weight;
        };
        if (node < 0) {
            add(0, static_cast<double>(1 - node));
            add(1, static_cast<double>(node));
        } else if (node > last) {
            add(last, static_cast<double>(node - last + 1));
            add(last - 1, static_cast<double>(last - node));
        } else {
            add(node, 1);
        }
    }
    return result;
}

}  // namespace defrec::cli
