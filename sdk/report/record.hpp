// What `defrec track` hands to the overlay and to the report: plain values, no library handle and
// no OpenCV type.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::cli {

/// DEFREC_POINT_*: the larger the less is known.
enum class VertexStatus : std::uint8_t {
    observed = DEFREC_POINT_OBSERVED,  ///< supported by this frame's stereo data
    extrapolated =
        DEFREC_POINT_EXTRAPOLATED,   ///< moved by the model only: hidden, or without data near
    unknown = DEFREC_POINT_UNKNOWN,  ///< no claim: not shown as geometry that is known
};

/// Projects `count` points (x, y, z interleaved, mm, left rectified camera) to pixels (u, v
/// interleaved) of the left image as it is handed to OverlayWriter::add and ReportWriter::add.
/// Points that cannot be projected (behind the camera, not finite) give NaN. Called on the caller's
/// thread only.
using Projector = std::function<void(const float* xyz, std::size_t count, float* uv)>;

/// The template as captured. Copied by whoever receives it.
struct TemplateRecord {
    std::vector<float>
        vertices;  ///< x, y, z interleaved, mm, left rectified camera of the template's frame
    std::vector<float>
        vertex_uv;  ///< u, v interleaved: where each vertex lies in the template's left image
    std::vector<std::uint32_t> triangles;  ///< three vertex indices each
};

/// A feature of the template and where it was found now, in pixels of the left image as given.
struct MatchSegment {
    float template_u = 0, template_v = 0;
    float live_u = 0, live_v = 0;
    float weight = 0;     ///< 0..1, the weight in the optimisation
    bool inlier = false;  ///< kept by RANSAC
};

/// A followed point; what is lost has status unknown and no position.
struct PointEstimate {
    VertexStatus status = VertexStatus::unknown;
    std::array<float, 3> xyz{};         ///< mm
    std::array<float, 6> covariance{};  ///< xx, xy, xz, yy, yz, zz, mm^2
    std::int64_t id = 0;
    std::string name{};      ///< given by the user; or empty
    bool is_chosen = false;  ///< by the user, and followed since this frame or an earlier one
};

/// Root mean square of the error to be expected, mm.
float expected_error(const PointEstimate& point);

/// A target beneath the surface; what is lost has status unknown and no position.
struct TargetEstimate : PointEstimate {
    float depth = std::numeric_limits<float>::quiet_NaN();  ///< mm; NaN: not given
};

/// The model of a plan, the same in every frame.
struct PlanModel {
    struct Part {
        std::string name;
        std::size_t first_triangle = 0, triangle_count = 0;
    };
    std::vector<std::uint32_t> triangles;  ///< three vertex indices each
    std::vector<Part> parts;
};

/// A plan's place in a frame. Without a model there is none.
struct PlanEstimate {
    std::shared_ptr<const PlanModel> model;
    std::vector<float> vertices;           ///< x, y, z interleaved, mm; or empty: lost
    std::vector<VertexStatus> status;      ///< one each
    std::vector<float> expected_error_mm;  ///< one each
    std::vector<PointEstimate> parts;      ///< their middles, with their names, in their order
    std::vector<PointEstimate> targets;    ///< in their order; the id is the place from 0
};

/// One frame's result. Vectors may be empty where the frame has none of it: a lost frame carries no
/// geometry. Fill the same object again for each frame to save allocations.
struct FrameRecord {
    std::int64_t index = 0;     ///< frame number in the input
    double timestamp_ms = 0;    ///< since the first frame, of the input's clock
    std::string state;          ///< initialising, tracking, degraded, lost, relocalised
    std::string reasons;        ///< names of the reasons, comma separated; empty if none
    std::string faulty_views;   ///< "left", "right", "both": of which reasons speak; or empty
    int features = 0;           ///< detected in this frame
    int matches = 0;            ///< matched to the template
    int inliers = 0;            ///< kept by RANSAC
    double observed_share = 0;  ///< 0..1, vertices with status observed
    /// NaN if nothing was measured.
    double mean_residual_mm = std::numeric_limits<double>::quiet_NaN();
    double frame_ms = 0;  ///< whole frame in the library, submit to result; 0 if unknown
    std::vector<std::pair<std::string, double>>
        stage_ms;  ///< name and milliseconds, in the order to be shown
    /// Rows of [R | t], mm: template's frame to the current left rectified camera.
    std::array<double, 12> rigid{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    std::vector<float>
        vertices;  ///< deformed, as TemplateRecord::vertices but of the current camera; or empty
    std::vector<VertexStatus> vertex_status;  ///< one each, or empty with `vertices`
    std::vector<float> expected_error_mm;     ///< one each, or empty: not known
    std::vector<float> control_points;        ///< x, y, z interleaved, mm, deformed
    std::vector<MatchSegment> matched;
    std::vector<PointEstimate> points;    ///< in the same order in every frame; new ones come last
    std::vector<TargetEstimate> targets;  ///< the same ones in every frame with geometry
    PlanEstimate plan;
};

}  // namespace defrec::cli
