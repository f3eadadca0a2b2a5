// What an application says of the body that a template's surface belongs to.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/body/closed_mesh.hpp"

namespace defrec {

struct BodyDescription {
    struct Region {
        ClosedMesh mesh;
        double stiffness = 1;  // relative to the rest of the body
        bool is_held = false;
    };
    std::optional<ClosedMesh> mesh;  // none: the tissue beneath the surface
    std::vector<Region> regions;
    double poisson_ratio = 0.43;
    double cut_depth_mm = 10;
};

// A copy of what desc says. Throws Error(DEFREC_ERROR_ARGUMENT) as defrec_template_set_body does;
// surface: the template's vertices.
std::shared_ptr<const BodyDescription> describe_body(const defrec_body_desc& desc,
                                                     std::span<const defrec_surface_point> surface);

}  // namespace defrec
