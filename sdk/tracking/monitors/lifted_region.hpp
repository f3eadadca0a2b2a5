// Which part of the first view's surface is seen off its place, and where it came apart from the
// rest: a flap is torn off along its sides, and not at its hinge.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/tracking/frame/frame_output.hpp"
#include "sdk/tracking/map/local_fit.hpp"

namespace defrec {

// Where a vertex's tissue is, if the image confirms the vertex: on its ray, at the live depth.
Vec3<double> live_place(const float position[3], float residual);
Vec3<double> live_place(const defrec_surface_sample& sample);
bool has_live_place(const defrec_surface_sample& sample);

struct LiftedRegion {
    uint8_t piece = 0;
    std::vector<uint8_t> is_lifted;  // per cell of the template's grid
    std::vector<CutLine> tears;      // none leads along the hinge
    std::vector<PointPair> pairs;    // of its vertices that are seen
};

// Whether any connection of control points is stretched so far that tissue may have come apart
// there: else there is no such part. nodes: where they are.
bool may_be_torn(const TemplateData& data, std::span<const Vec3<double>> nodes);

// The largest such part; none where it is small, at the image's border, or not torn off beyond the
// template's cuts.
// is_confirmed: photometric evidence, per vertex.
std::optional<LiftedRegion> find_lifted_region(const TemplateData& data, const FrameOutput& output,
                                               std::span<const uint8_t> is_confirmed);

}  // namespace defrec
