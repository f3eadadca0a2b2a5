// A plan's model with few vertices, for the page's view in 3D.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdk/report/record.hpp"

namespace defrec::cli {

/// Vertices of the model that stand for their neighbours, part by part: one of each cell of a grid
/// whose cells are as small as the number of vertices allows [Rossignac 1993].
class LightPlan {
  public:
    static constexpr std::size_t kVertices = 1500;

    LightPlan() = default;
    /// plan: of a frame that has geometry; its positions say which vertices are neighbours.
    explicit LightPlan(const PlanEstimate& plan);

    bool is_empty() const { return triangles_.empty(); }
    /// Three indices each of the vertices that were kept; parts follow each other.
    const std::vector<std::uint32_t>& triangles() const { return triangles_; }
    const std::vector<PlanModel::Part>& parts() const { return parts_; }
    /// x, y, z of the vertices that were kept; NaN where they are unknown. Empty in a lost frame.
    std::vector<float> positions(const PlanEstimate& plan) const;
    /// Their expected errors, mm. Empty likewise.
    std::vector<float> expected_error_mm(const PlanEstimate& plan) const;

  private:
    std::size_t all_ = 0;              // of the model
    std::vector<std::uint32_t> kept_;  // places in the model
    std::vector<std::uint32_t> triangles_;
    std::vector<PlanModel::Part> parts_;
};

}  // namespace defrec::cli
