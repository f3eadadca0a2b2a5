// Continues a displacement that is known at the control points round a hole into the hole: each
// control point in it has the mean of those that it is connected with (a discrete harmonic
// function; Pinkall and Polthier, Computing discrete minimal surfaces and their conjugates, 1993,
// with equal weights).
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

class HoleFill {
  public:
    enum Kind : uint8_t { kNeither, kKnown, kHole };

    // kinds: per control point. Connections between pieces, or across a cut, are none.
    void find(std::span<const defrec_edge> edges, std::span<const Kind> kinds);
    // Known control points that a hole is connected with; each once.
    std::span<const uint32_t> border() const { return border_; }
    // A column for each control point; those of the border are given.
    Eigen::Matrix3Xd& values() { return values_; }
    const Eigen::Matrix3Xd& values() const { return values_; }
    void fill();

  private:
    struct Hole {
        uint32_t node, first, end;  // of others_
    };
    std::vector<uint32_t> border_, others_;
    std::vector<Hole> holes_;
    std::vector<uint8_t> is_on_border_;
    std::vector<uint32_t> next_;  // per control point: begin of its part of others_
    Eigen::Matrix3Xd values_;
};

}  // namespace defrec
