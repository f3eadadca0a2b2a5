// What a frame becomes for the application: all that defrec_job_result() gives, and what points are
// moved by.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "sdk/body/body_slot.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"
#include "sdk/tracking/frame/rig_estimate.hpp"
#include "sdk/tracking/monitors/frame_state.hpp"
#include "sdk/tracking/points/point_carrier.hpp"

namespace defrec {

struct FrameResult {
    std::shared_ptr<const Template> surface;  // null: there is none yet
    VertexConfidence confidence;
    std::vector<defrec_motion> motions;                    // of the control points
    std::vector<float> vertices, normals, node_positions;  // frame coordinates
    std::vector<defrec_piece> pieces;
    std::array<double, 12> rigid_motion{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    DeepKnowledge known;  // of what lies beneath the surface
    Evidence evidence;
    float observed_share = 0;  // of the vertices inside the image
    RigEstimate rig_estimate;
    uint32_t state = DEFREC_INITIALISING, reasons = 0, faulty_views = 0;
    uint32_t epoch = 0, template_epoch = 0, age = 0;

    bool is_interlaced() const { return (reasons & DEFREC_REASON_INTERLACED) != 0; }

    // Writes what is held here; without a surface nothing of it.
    void describe(defrec_result& out) const {
        out.state = state;
        out.reasons = reasons;
        out.faulty_views = faulty_views;
        out.epoch = epoch;
        out.template_epoch = template_epoch;
        out.age = age;
        std::copy(rigid_motion.begin(), rigid_motion.end(), out.rigid_motion);
        out.view_lag_frames = rig_estimate.lag_frames;
        out.vertical_offset_px = rig_estimate.vertical_offset_px;
        out.roll_deg = rig_estimate.roll_deg;
        out.focal_ratio = rig_estimate.focal_ratio;
        out.rig_matches = rig_estimate.matches;
        if (surface == nullptr) return;
        const TemplateData& data = surface->data();
        out.matches = evidence.matches;
        out.inliers = evidence.inliers;
        out.patches = evidence.patches_confirmed;
        out.observed_share = observed_share;
        out.mean_residual_mm = static_cast<float>(evidence.mean_residual_mm);
        out.patch_residual_px = static_cast<float>(evidence.patch_rms_px);
        out.motions = motions.data();
        out.node_positions = node_positions.data();
        out.node_count = motions.size();
        out.vertices = vertices.data();
        out.normals = normals.data();
        out.vertex_status = confidence.status.data();
        out.expected_error_mm = confidence.expected_error.data();
        out.vertex_covariance = confidence.covariance.data();
        out.vertex_evidence = confidence.evidence.data();
        out.vertex_count = data.vertices.size();
        out.landmarks = data.landmarks.data();
        out.landmark_count = data.landmarks.size();
        out.patch_count = data.patches.size();
        out.body = surface->body().state();
        out.pieces = pieces.data();
        out.piece_count = pieces.size();
    }
};

}  // namespace defrec
