// See hole_fill.hpp.
#include "sdk/tracking/points/hole_fill.hpp"

#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {

void HoleFill::find(std::span<const defrec_edge> edges, std::span<const Kind> kinds) {
    border_.clear();
    holes_.clear();
    is_on_border_.assign(kinds.size(), 0);
    values_.setZero(3, static_cast<Eigen::Index>(kinds.size()));
    const auto for_connections = [&](const auto& connect) {
        for (const defrec_edge& edge : edges) {
            const auto a = static_cast<uint32_t>(edge.a), b = static_cast<uint32_t>(edge.b);
            if (kinds[a] == kHole && kinds[b] != kNeither) connect(a, b);
            if (kinds[b] == kHole && kinds[a] != kNeither) connect(b, a);
        }
    };
    next_.assign(kinds.size(), 0);
    for_connections([&](uint32_t hole, uint32_t) { ++next_[hole]; });
    uint32_t all = 0;
    for (uint32_t node = 0; node < kinds.size(); ++node) {
        const uint32_t count = next_[node];
        if (count > 0) holes_.push_back({node, all, all + count});
        next_[node] = all;
        all += count;
    }
    others_.resize(all);
    for_connections([&](uint32_t hole, uint32_t other) {
        others_[next_[hole]++] = other;
        if (kinds[other] != kKnown || is_on_border_[other] != 0) return;
        is_on_border_[other] = 1;
        border_.push_back(other);
    });
}

// Successive overrelaxation (Young, Iterative methods for solving partial difference equations of
// elliptic type, 1954).
void HoleFill::fill() {
    using Decision = decisions::UnseenMotion;
    if (border_.empty()) return;
    for (int round = 0; round < Decision::kFillRounds; ++round)
        for (const Hole& hole : holes_) {
            Eigen::Vector3d sum = Eigen::Vector3d::Zero();
            for (uint32_t k = hole.first; k < hole.end; ++k) sum += values_.col(others_[k]);
            auto value = values_.col(hole.node);
            value += Decision::kFillStep * (sum / (hole.end - hole.first) - value);
        }
}

}  // namespace defrec
