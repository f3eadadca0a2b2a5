// Growth: tissue that came into view joins the template.
#pragma once
#include <span>
#include <vector>

#include "sdk/template/capture.hpp"
#include "sdk/template/node_anchor.hpp"

namespace defrec {

// A frame in which the template was found.
struct FoundFrame {
    CaptureInput images;
    std::span<const defrec_motion> motions;  // per control point
};

struct Growth {
    enum class Outcome {
        kGrown,
        kNothingNew,  // no tissue beside the surface that both frames show
        kUnfit,       // what is seen now does not lie where the surface was found
        kFull         // more than the limit, or no view left for its image
    };
    Outcome outcome = Outcome::kNothingNew;
    TemplateData data;  // the template that it joined and what is new, when grown
    std::vector<NodeAnchor>
        anchors;  // per new control point: it follows them until it has evidence
};

// The template with the tissue beside it that both frames show at the same place. max_vertices: of
// the result.
Growth grow_template(const TemplateData& data, const FoundFrame& earlier, const FoundFrame& now,
                     size_t max_vertices);

// Appends motions of the control points that have anchors: those of a rigid body with their
// anchors. nodes: of the grown template.
void extend_motions(const std::vector<float>& nodes, std::span<const NodeAnchor> anchors,
                    std::vector<defrec_motion>& motions);

}  // namespace defrec
