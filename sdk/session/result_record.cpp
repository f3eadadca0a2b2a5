// A job's result in the shapes that the output files, the report and the live link take.
#include "sdk/session/result_record.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace defrec::cli {
namespace {

VertexStatus vertex_status(PointStatus status) {
    return status == PointStatus::kTracked        ? VertexStatus::observed
           : status == PointStatus::kExtrapolated ? VertexStatus::extrapolated
                                                  : VertexStatus::unknown;
}

PointEstimate chosen_estimate(const PointRow& row) {
    PointEstimate point = point_estimate(row);
    point.name = row.name;
    point.is_chosen = row.is_chosen;
    return point;
}

TargetEstimate target_estimate(const TargetRow& row) {
    TargetEstimate target{point_estimate(row)};
    if (row.depth) target.depth = static_cast<float>(*row.depth);
    return target;
}

void fill_matches(const defrec_result& result, RawProjection& projection,
                  std::vector<MatchSegment>& segments) {
    std::vector<float> positions;
    std::vector<double> live;
    std::vector<float> weights;
    for (std::uint64_t i = 0; i < result.landmark_count; ++i) {
        const defrec_match& match = result.landmark_matches[i];
        if (match.feature < 0) continue;
        positions.insert(positions.end(), result.landmarks[i].position,
                         result.landmarks[i].position + 3);
        live.insert(live.end(), {static_cast<double>(match.u), static_cast<double>(match.v)});
        weights.push_back(match.weight);
    }
    std::vector<float> reference(2 * weights.size());
    projection.project(positions.data(), weights.size(), reference.data());
    projection.distort(live.data(), weights.size());
    for (std::size_t i = 0; i < weights.size(); ++i) {
        segments.push_back({reference[2 * i], reference[2 * i + 1], static_cast<float>(live[2 * i]),
                            static_cast<float>(live[2 * i + 1]), weights[i], weights[i] > 0});
    }
}

const char* name_of_views(std::uint32_t views) {
    constexpr std::uint32_t kBoth = DEFREC_VIEW_LEFT | DEFREC_VIEW_RIGHT;
    return (views & kBoth) == kBoth           ? "both"
           : (views & DEFREC_VIEW_LEFT) != 0  ? "left"
           : (views & DEFREC_VIEW_RIGHT) != 0 ? "right"
                                              : "";
}

}  // namespace

VertexStatus vertex_status(std::uint8_t status) {
    return status < DEFREC_POINT_UNKNOWN ? VertexStatus{status} : VertexStatus::unknown;
}

LinkPoint link_point(const PositionRow& row) {
    return {row.id, name_of(row.status), std::to_array(row.xyz), row.expected_error_mm};
}

PointEstimate point_estimate(const PositionRow& row) {
    PointEstimate point;
    point.id = row.id;
    point.status = vertex_status(row.status);
    if (row.status == PointStatus::kLost) return point;
    std::copy(std::begin(row.xyz), std::end(row.xyz), point.xyz.begin());
    std::copy(std::begin(row.covariance), std::end(row.covariance), point.covariance.begin());
    return point;
}

bool has_geometry(const defrec_result& result) {
    return result.state != DEFREC_LOST && result.state != DEFREC_INITIALISING &&
           result.vertex_count > 0;
}

FrameRow frame_row(const StereoFrame& frame, const defrec_result& result) {
    FrameRow row;
    row.frame = frame.index;
    row.timestamp_ms = frame.timestamp_ms;
    row.state = state_name(result.state);
    row.reasons = reason_names(result.reasons, "|");
    row.faulty_views = name_of_views(result.faulty_views);
    row.epoch = result.epoch;
    row.age = result.age;
    row.features = result.features;
    row.matches = result.matches;
    row.inliers = result.inliers;
    row.patches = result.patches;
    row.observed_share = result.observed_share;
    // A surface of which nothing is measured, as with one view alone, has no residual.
    row.mean_residual_mm = has_geometry(result) && result.observed_share > 0
                               ? result.mean_residual_mm
                               : std::numeric_limits<double>::quiet_NaN();
    row.view_lag_frames = result.view_lag_frames;
    row.vertical_offset_px = result.vertical_offset_px;
    row.roll_deg = result.roll_deg;
    row.focal_ratio = result.focal_ratio;
    row.rig_matches = result.rig_matches;
    for (std::uint32_t i = 0;
         i < std::min<std::uint32_t>(result.time_count, DEFREC_MAX_TIMED_STAGES); ++i) {
        row.stage_ms.emplace_back(result.times[i].name, result.times[i].milliseconds);
        row.frame_ms += result.times[i].milliseconds;
    }
    return row;
}

TemplateRecord template_record(const defrec_template_info& info, RawProjection& projection) {
    TemplateRecord record;
    for (std::uint64_t i = 0; i < info.vertex_count; ++i) {
        record.vertices.insert(record.vertices.end(), info.vertices[i].position,
                               info.vertices[i].position + 3);
    }
    record.vertex_uv.resize(2 * info.vertex_count);
    projection.project(record.vertices.data(), info.vertex_count, record.vertex_uv.data());
    record.triangles.assign(info.triangles, info.triangles + 3 * info.triangle_count);
    return record;
}

void fill_record(const FrameRow& row, const defrec_result& result,
                 const std::vector<PointRow>& points, const std::vector<TargetRow>& targets,
                 RawProjection& projection, FrameRecord& record) {
    record.index = row.frame;
    record.timestamp_ms = row.timestamp_ms;
    record.state = row.state;
    record.reasons = reason_names(result.reasons, ", ");
    record.faulty_views = row.faulty_views;
    record.features = static_cast<int>(row.features);
    record.matches = static_cast<int>(row.matches);
    record.inliers = static_cast<int>(row.inliers);
    record.observed_share = row.observed_share;
    record.mean_residual_mm = row.mean_residual_mm;
    record.frame_ms = row.frame_ms;
    record.stage_ms = row.stage_ms;
    std::copy(std::begin(result.rigid_motion), std::end(result.rigid_motion), record.rigid.begin());
    record.vertices.clear();
    record.vertex_status.clear();
    record.expected_error_mm.clear();
    record.control_points.clear();
    record.matched.clear();
    record.points.clear();
    record.targets.clear();
    std::transform(points.begin(), points.end(), std::back_inserter(record.points),
                   &chosen_estimate);
    if (!has_geometry(result)) return;
    record.vertices.assign(result.vertices, result.vertices + 3 * result.vertex_count);
    std::transform(result.vertex_status, result.vertex_status + result.vertex_count,
                   std::back_inserter(record.vertex_status),
                   [](std::uint8_t status) { return vertex_status(status); });
    record.expected_error_mm.assign(result.expected_error_mm,
                                    result.expected_error_mm + result.vertex_count);
    record.control_points.assign(result.node_positions,
                                 result.node_positions + 3 * result.node_count);
    fill_matches(result, projection, record.matched);
    std::transform(targets.begin(), targets.end(), std::back_inserter(record.targets),
                   &target_estimate);
}

std::vector<ViewPoint> view_points(const std::vector<PointRow>& points) {
    std::vector<ViewPoint> shown;
    for (const PointRow& row : points)
        shown.push_back({row.id, vertex_status(row.status), row.uv[0], row.uv[1], row.xyz[0],
                         row.xyz[1], row.xyz[2], row.expected_error_mm, row.name, row.is_chosen});
    return shown;
}

LinkFrame link_frame(const StereoFrame& frame, const defrec_result& result,
                     std::shared_ptr<const std::vector<std::uint32_t>> triangles,
                     const std::vector<PointRow>& points, const std::vector<TargetRow>& targets) {
    LinkFrame link;
    link.index = frame.index;
    link.timestamp_ns = result.timestamp_ns;
    link.state = result.state;
    link.reasons = result.reasons;
    link.epoch = result.epoch;
    link.has_geometry = has_geometry(result);
    if (!link.has_geometry) return link;
    std::copy(std::begin(result.rigid_motion), std::end(result.rigid_motion),
              link.rigid_motion.begin());
    link.vertices.assign(result.vertices, result.vertices + 3 * result.vertex_count);
    link.vertex_status.assign(result.vertex_status, result.vertex_status + result.vertex_count);
    link.expected_error_mm.assign(result.expected_error_mm,
                                  result.expected_error_mm + result.vertex_count);
    link.vertex_covariance.assign(result.vertex_covariance,
                                  result.vertex_covariance + 6 * result.vertex_count);
    link.vertex_evidence.assign(result.vertex_evidence,
                                result.vertex_evidence + result.vertex_count);
    link.triangles = std::move(triangles);
    for (const PointRow& row : points)
        if (row.status != PointStatus::kLost) link.points.push_back(link_point(row));
    for (const TargetRow& row : targets) {
        if (row.status == PointStatus::kLost) continue;
        LinkTarget target{link_point(row)};
        std::copy(std::begin(row.covariance), std::end(row.covariance), target.covariance.begin());
        link.targets.push_back(target);
    }
    return link;
}

}  // namespace defrec::cli
