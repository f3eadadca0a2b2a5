// The control points beside a place that has none of its own: it moves as a rigid body with them.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "backends/shared/motion.hpp"
#include "include/defrec_c.h"
#include "sdk/template/decisions.hpp"

namespace defrec {

struct NearestNodes {
    static constexpr size_t kNodes = decisions::Anchors::kAnchors;
    std::array<int32_t, kNodes> node{};
    std::array<double, kNodes> weight{};  // 0: none
};

// The nearest one and the nearest of its piece of the surface, with weights that fall off with the
// distance. nodes: where they are. piece: of the surface, per node; empty: there is one.
// spacing_mm: between neighbouring nodes.
NearestNodes nearest_nodes_at(std::span<const Vec3<double>> nodes, std::span<const uint8_t> piece,
                              double spacing_mm, const Vec3<double>& place);

// The rigid motion (Kabsch) that takes an anchor's control points at rest to where they are. rest:
// xyz of all. motions: of all.
DualQuaternion<double> follow_nearest_nodes(const NearestNodes& anchor, std::span<const float> rest,
                                            std::span<const defrec_motion> motions);

// The positions of a control point, and of all. rest: xyz of all.
inline Vec3<double> node_position(std::span<const float> rest,
                                  std::span<const defrec_motion> motions, size_t node) {
    return apply(DualQuaternion<double>::load(motions[node]), load3<double>(&rest[3 * node]));
}
std::vector<Vec3<double>> node_positions(std::span<const float> rest,
                                         std::span<const defrec_motion> motions);

}  // namespace defrec
