// Growth: tissue that came into view joins the template.
#pragma once
#include <span>
#include <vector>

#include "sdk/template/new_tissue.hpp"

namespace defrec {

struct Growth {
    enum class Outcome {
        kGrown,
        kNothingNew,  // no tissue beside the surface that both frames show
        kUnfit,       // what is seen now does not lie where the surface was found
        kFull         // more than the limit, or no view left for its image
    };
    Outcome outcome = Outcome::kNothingNew;
    TemplateData data;  // the template that it joined and what is new, when grown
    // Per new control point: those that it follows until it has evidence of its own.
    std::vector<NearestNodes> anchors;
};

// The template with the tissue beside it that both frames show at the same place. max_vertices: of
// the result.
Growth grow_template(const TemplateData& data, const FoundFrame& earlier, const FoundFrame& now,
                     size_t max_vertices);

// Appends motions of the control points that have anchors: those of a rigid body with their
// anchors. nodes: of the grown template.
void extend_motions(const std::vector<float>& nodes, std::span<const NearestNodes> anchors,
                    std::vector<defrec_motion>& motions);

}  // namespace defrec
