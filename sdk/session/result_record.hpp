// A job's result in the shapes that the output files, the report and the live link take.
#pragma once

#include <memory>

#include "sdk/client/library.hpp"
#include "sdk/live_link/frame.hpp"
#include "sdk/live_view/view_frame.hpp"
#include "sdk/report/record.hpp"
#include "sdk/session/frame_projection.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {

FrameRow frame_row(const StereoFrame& frame, const defrec_result& result);

// DEFREC_POINT_*.
VertexStatus vertex_status(std::uint8_t status);
PointEstimate point_estimate(const PositionRow& row);
LinkPoint link_point(const PositionRow& row);

// Vertices, their pixels in the template's left image, triangles.
TemplateRecord template_record(const defrec_template_info& info, RawProjection& projection);

// points and targets, here and below: the rows of this frame.
// Fills `record` anew, but for its plan. A frame that is lost or still initialising carries no
// geometry.
void fill_record(const FrameRow& row, const defrec_result& result,
                 const std::vector<PointRow>& points, const std::vector<TargetRow>& targets,
                 RawProjection& projection, FrameRecord& record);

LinkFrame link_frame(const StereoFrame& frame, const defrec_result& result,
                     std::shared_ptr<const std::vector<std::uint32_t>> triangles,
                     const std::vector<PointRow>& points, const std::vector<TargetRow>& targets);

std::vector<ViewPoint> view_points(const std::vector<PointRow>& points);

// True when the geometry of this result may be shown as that of its frame.
bool has_geometry(const defrec_result& result);

}  // namespace defrec::cli
