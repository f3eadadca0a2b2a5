// What a frame becomes for the application: all that defrec_job_result() gives, and what points are
// moved by.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

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
    uint32_t state = DEFREC_INITIALISING, reasons = 0, epoch = 0, template_epoch = 0, age = 0;

    bool is_interlaced() const { return (reasons & DEFREC_REASON_INTERLACED) != 0; }
};

}  // namespace defrec
