// Surface points grouped by the control points that move them: within a group the motions are the
// same for all, and SIMD lanes are points.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "backends/shared/motion.hpp"
#include "backends/shared/stage.hpp"

namespace defrec::cpu {

constexpr size_t kBlendNodes = DEFREC_BLEND_NODES;
constexpr size_t kLanes = 16;  // most that are used; groups begin at multiples

inline size_t padded(size_t count, size_t lanes = kLanes) {
    return (count + lanes - 1) / lanes * lanes;
}

// Control points ascending; of one that is named more than once, only the first has a weight.
struct BlendWeights {
    std::array<int32_t, kBlendNodes> node;
    std::array<float, kBlendNodes> weight;
    size_t first;  // where the item's own first entry is now

    template <class Item>
    explicit BlendWeights(const Item& item) {
        std::array<size_t, kBlendNodes> order{0, 1, 2, 3};
        std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
            return std::pair(item.node[a], a) < std::pair(item.node[b], b);
        });
        for (size_t k = 0; k < kBlendNodes; ++k) {
            node[k] = item.node[order[k]];
            weight[k] = item.weight[order[k]];
        }
        for (size_t k = kBlendNodes - 1; k > 0; --k)
            if (node[k] == node[k - 1]) {
                weight[k - 1] += weight[k];
                weight[k] = 0;
            }
        first = size_t(std::find(node.begin(), node.end(), item.node[0]) - node.begin());
    }
};

// One item of a group: which, and of which list.
struct BlendKey {
    std::array<int32_t, kBlendNodes> node;
    uint32_t list, index;
    auto operator<=>(const BlendKey&) const = default;
};

// A control point's motion in single precision, ready to be broadcast.
struct NodeMotion {
    float dual_quaternion[8];  // real wxyz, dual wxyz
    float rotation[9];         // row-major
    float rest[3];             // position in the template frame

    void set(const DualQuaternion<double>& motion, Vec3<double> position) {
        const auto [real, dual] = motion;
        const double q[8] = {real.w, real.x, real.y, real.z, dual.w, dual.x, dual.y, dual.z};
        std::copy(q, q + 8, dual_quaternion);
        double r[9], t[3];
        to_rigid(motion, r, t);
        std::copy(r, r + 9, rotation);
        store3(position, rest);
    }
};

// The motions of a group's control points, all in the hemisphere of one of them.
struct GroupMotion {
    float dual_quaternion[kBlendNodes][8];
    size_t first;
    bool together;  // no rotation is as far as 90 degrees from the first's: any other one for the
                    // first gives the same motions

    GroupMotion(const NodeMotion* motions, const std::array<int32_t, kBlendNodes>& node,
                size_t whose = 0)
        : first(whose), together(true) {
        constexpr float kTogether = 0.7072f;  // above the cosine of half of 90 degrees
        const float* f = motions[node[first]].dual_quaternion;
        for (size_t k = 0; k < kBlendNodes; ++k) {
            const float* q = motions[node[k]].dual_quaternion;
            const float cosine = q[0] * f[0] + q[1] * f[1] + q[2] * f[2] + q[3] * f[3];
            together &= std::abs(cosine) > kTogether;
            for (size_t i = 0; i < 8; ++i) dual_quaternion[k][i] = cosine < 0 ? -q[i] : q[i];
        }
    }
};

}  // namespace defrec::cpu
