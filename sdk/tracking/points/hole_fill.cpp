// See hole_fill.hpp.
#include "sdk/tracking/points/hole_fill.hpp"

#include <algorithm>

#include "sdk/tracking/decisions/unseen.hpp"

namespace defrec {
namespace {

using Decision = decisions::HoleFill;

bool is_known(HoleFill::Kind kind) { return kind == HoleFill::kKnown; }
bool is_in_hole(HoleFill::Kind kind) {
    return kind == HoleFill::kHole || kind == HoleFill::kUnread;
}

// Wendland's function of order 4 in three dimensions (Piecewise polynomial, positive definite and
// compactly supported radial functions of minimal degree, 1995). distance: in reaches.
auto wendland(const Eigen::ArrayXXf& distance) {
    const auto left = (1 - distance).max(0.0f);
    return (left.square() * left.square() * left.square() *
            (35 * distance.square() + 18 * distance + 3) / 3)
        .eval();
}

}  // namespace

HoleFill::HoleFill(std::span<const defrec_edge> edges, std::span<const float> nodes, float reach_mm)
    : places_(Eigen::Map<const Eigen::Matrix3Xf>(nodes.data(), 3,
                                                 static_cast<Eigen::Index>(nodes.size() / 3)) /
              reach_mm) {
    const size_t count = nodes.size() / 3;
    first_.assign(count + 1, 0);
    for (const defrec_edge& edge : edges) {
        ++first_[static_cast<size_t>(edge.a) + 1];
        ++first_[static_cast<size_t>(edge.b) + 1];
    }
    for (size_t node = 0; node < count; ++node) first_[node + 1] += first_[node];
    connected_.resize(2 * edges.size());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (const defrec_edge& edge : edges) {
        const auto a = static_cast<uint32_t>(edge.a), b = static_cast<uint32_t>(edge.b);
        connected_[next[a]++] = b;
        connected_[next[b]++] = a;
    }
}

void HoleFill::find(std::span<const Kind> kinds) {
    known_.clear();
    count_ = 0;
    is_known_.assign(kinds.size(), 0);
    hole_of_.assign(kinds.size(), 0);
    values_.setZero(3, static_cast<Eigen::Index>(kinds.size()));
    uint32_t mark = 0;
    for (uint32_t node = 0; node < kinds.size(); ++node) {
        if (!is_in_hole(kinds[node]) || hole_of_[node] != 0) continue;
        if (count_ == holes_.size()) holes_.emplace_back();
        Hole& hole = holes_[count_];
        find_hole(kinds, node, ++mark, hole);
        if (std::none_of(hole.inside.begin(), hole.inside.end(),
                         [&](uint32_t inside) { return kinds[inside] == kHole; }))
            continue;
        ++count_;
        find_covariances(hole);
        for (const uint32_t round : hole.round) {
            if (is_known_[round] != 0) continue;
            is_known_[round] = 1;
            known_.push_back(round);
        }
    }
}

// The hole of a control point, and what is known at most `rings` connections from it.
void HoleFill::find_hole(std::span<const Kind> kinds, uint32_t node, uint32_t mark, Hole& hole) {
    const auto add_connected = [&](uint32_t to, bool is_wanted(Kind),
                                   std::vector<uint32_t>& found) {
        for_connected(to, [&](uint32_t other) {
            if (!is_wanted(kinds[other]) || hole_of_[other] == mark) return;
            hole_of_[other] = mark;
            found.push_back(other);
        });
    };
    hole.inside.assign(1, node);
    hole_of_[node] = mark;
    for (size_t i = 0; i < hole.inside.size(); ++i)
        add_connected(hole.inside[i], is_in_hole, hole.inside);
    hole.round.clear();
    for (const uint32_t inside : hole.inside) add_connected(inside, is_known, hole.round);
    size_t begin = 0;
    for (int ring = 1; ring < Decision::kRings; ++ring) {
        const size_t end = hole.round.size();
        for (; begin < end; ++begin) add_connected(hole.round[begin], is_known, hole.round);
    }
    const size_t step = (hole.round.size() + Decision::kMost - 1) / Decision::kMost;
    if (step <= 1) return;
    size_t kept = 0;
    for (size_t i = 0; i < hole.round.size(); i += step) hole.round[kept++] = hole.round[i];
    hole.round.resize(kept);
}

Eigen::MatrixXf HoleFill::covariances(std::span<const uint32_t> a,
                                      std::span<const uint32_t> b) const {
    Eigen::ArrayXXf distance(a.size(), b.size());
    const Eigen::Matrix3Xf from = places_(Eigen::all, a);
    for (size_t k = 0; k < b.size(); ++k)
        distance.col(static_cast<Eigen::Index>(k)) =
            (from.colwise() - places_.col(b[k])).colwise().norm().transpose();
    return wendland(distance);
}

void HoleFill::find_covariances(Hole& hole) const {
    Eigen::MatrixXf covariance = covariances(hole.round, hole.round);
    covariance.diagonal().array() += Decision::kNoise;
    hole.covariance.compute(covariance);
    hole.to_inside = covariances(hole.inside, hole.round);
}

void HoleFill::fill() {
    for (const Hole& hole : std::span(holes_).first(count_)) {
        if (hole.round.empty()) continue;
        // As spans, of which expressions make no copies.
        const std::span<const uint32_t> round(hole.round), inside(hole.inside);
        const Eigen::MatrixX3f given = values_(Eigen::all, round).transpose();
        values_(Eigen::all, inside) = (hole.to_inside * hole.covariance.solve(given)).transpose();
    }
}

}  // namespace defrec
