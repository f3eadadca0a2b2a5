// See hole_fill.hpp.
#include "sdk/tracking/points/hole_fill.hpp"

#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {

void HoleFill::find(std::span<const defrec_edge> edges, std::span<const Kind> kinds) {
    border_.clear();
    holes_.clear();
    connections_.clear();
    is_on_border_.assign(kinds.size(), 0);
    const auto nodes = static_cast<Eigen::Index>(kinds.size());
    count_.setZero(nodes);
    values_.setZero(3, nodes);
    sums_.resize(3, nodes);
    const auto connect = [&](uint32_t hole, uint32_t other) {
        if (kinds[hole] != kHole || kinds[other] == kNeither) return;
        connections_.push_back({hole, other});
        count_[hole] += 1;
        if (kinds[other] != kKnown || is_on_border_[other] != 0) return;
        is_on_border_[other] = 1;
        border_.push_back(other);
    };
    for (const defrec_edge& edge : edges) {
        const auto a = static_cast<uint32_t>(edge.a), b = static_cast<uint32_t>(edge.b);
        connect(a, b);
        connect(b, a);
    }
    for (uint32_t node = 0; node < kinds.size(); ++node)
        if (count_[node] > 0) holes_.push_back(node);
}

void HoleFill::fill() {
    if (border_.empty()) return;
    for (int round = 0; round < decisions::UnseenMotion::kFillRounds; ++round) {
        sums_.setZero();
        for (const Connection& connection : connections_)
            sums_.col(connection.hole) += values_.col(connection.other);
        for (const uint32_t node : holes_) values_.col(node) = sums_.col(node) / count_[node];
    }
}

}  // namespace defrec
