// Continues a displacement that is known at the control points round a hole into the hole, with the
// slope that it has there: simple kriging (Cressie, Statistics for Spatial Data, 1993, 3.2) with a
// covariance of bounded reach, so that it fades to 0 far from what is known.
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

class HoleFill {
  public:
    // kUnread: in a hole as well, but nobody reads its value. A hole of no others is left empty.
    enum Kind : uint8_t { kNeither, kKnown, kHole, kUnread };

    HoleFill() = default;
    // For a template's control points; nodes: x, y, z of each, mm. reach_mm: from which distance on
    // nothing tells of the other. Nothing is continued but along connections.
    HoleFill(std::span<const defrec_edge> edges, std::span<const float> nodes, float reach_mm);

    // kinds: per control point.
    void find(std::span<const Kind> kinds);
    // Known control points by which holes are filled; each once.
    std::span<const uint32_t> known() const { return known_; }
    // A column for each control point; those that are known are given, those that are neither in a
    // hole nor known are 0.
    Eigen::Matrix3Xf& values() { return values_; }
    const Eigen::Matrix3Xf& values() const { return values_; }
    void fill();

  private:
    // Control points in a hole that are connected, and those that are known round them.
    struct Hole {
        std::vector<uint32_t> inside, round;
        Eigen::LLT<Eigen::MatrixXf> covariance;  // of those round it
        Eigen::MatrixXf to_inside;               // a row for each inside
    };
    template <class Function>
    void for_connected(uint32_t node, const Function& function) const {
        for (uint32_t k = first_[node]; k < first_[node + 1]; ++k) function(connected_[k]);
    }
    void find_hole(std::span<const Kind> kinds, uint32_t node, uint32_t mark, Hole& hole);
    void find_covariances(Hole& hole) const;
    Eigen::MatrixXf covariances(std::span<const uint32_t> a, std::span<const uint32_t> b) const;

    std::vector<uint32_t> first_, connected_;  // per control point: its part of connected_
    Eigen::Matrix3Xf places_;                  // in reaches
    Eigen::Matrix3Xf values_;
    std::vector<Hole> holes_;  // with the memory of former ones
    size_t count_ = 0;         // of holes_
    std::vector<uint32_t> known_;
    std::vector<uint8_t> is_known_;  // per control point: it is in known_
    std::vector<uint32_t> hole_of_;  // per control point: the hole it was last found for, from 1
};

}  // namespace defrec
