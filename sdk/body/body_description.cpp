// See body_description.hpp.
#include "sdk/body/body_description.hpp"

#include <cmath>
#include <string>

#include "sdk/base/util/check_ranges.hpp"

namespace defrec {
namespace {

double region_stiffness(const defrec_body_region& region, const std::string& name) {
    constexpr float kLeast = 0.01f, kMost = 1000;  // as the header has it
    if ((region.flags & ~uint32_t{DEFREC_REGION_HELD}) != 0)
        fail(DEFREC_ERROR_ARGUMENT, name, ".flags has unknown bits: ", region.flags);
    if (region.stiffness == 0) return 1;
    if (!(region.stiffness >= kLeast && region.stiffness <= kMost))
        fail(DEFREC_ERROR_ARGUMENT, name, ".stiffness is ", region.stiffness, ", ", kLeast, " to ",
             kMost, " expected");
    return region.stiffness;
}

}  // namespace

std::shared_ptr<const BodyDescription> describe_body(
    const defrec_body_desc& desc, std::span<const defrec_surface_point> surface) {
    check_ranges(desc);
    if (desc.flags != 0) fail(DEFREC_ERROR_ARGUMENT, "desc.flags is ", desc.flags, ", not 0");
    defrec_body_desc filled = desc;
    fill_defaults(filled);
    auto body = std::make_shared<BodyDescription>();
    body->poisson_ratio = static_cast<double>(filled.poisson_ratio);
    body->cut_depth_mm = static_cast<double>(filled.cut_depth_mm);
    if (filled.mesh.vertex_count != 0 || filled.mesh.triangle_count != 0) {
        body->mesh.emplace(filled.mesh, "mesh");
        body->mesh->check_meets(surface, "mesh");
    }
    if (filled.region_count != 0 && filled.regions == nullptr)
        fail(DEFREC_ERROR_ARGUMENT, "regions is NULL and region_count is ", filled.region_count);
    for (size_t i = 0; i < filled.region_count; ++i) {
        const defrec_body_region& region = filled.regions[i];
        const std::string name = "regions[" + std::to_string(i) + "]";
        const double stiffness = region_stiffness(region, name);
        body->regions.push_back({ClosedMesh(region.mesh, name + ".mesh"), stiffness,
                                 (region.flags & DEFREC_REGION_HELD) != 0});
    }
    return body;
}

}  // namespace defrec
