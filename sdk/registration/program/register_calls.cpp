// See register_calls.hpp.
#include "sdk/registration/program/register_calls.hpp"

#include <algorithm>
#include <limits>
#include <numbers>
#include <string_view>

namespace defrec::cli {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// What the library says of an input, as the program's own error.
void expect_accepted(defrec_status status, const std::string& path) {
    if (status == DEFREC_ERROR_ARGUMENT)
        throw CliError(ExitCode::kInput, path + ": " + defrec_last_error() + ".");
    require(status, ExitCode::kInput, path);
}

Registered registered(defrec_registration handle) {
    Registered made;
    made.handle.reset(handle);
    made.info = initialised<defrec_registration_info>();
    require(defrec_registration_get(handle, &made.info), ExitCode::kInternal, "reading the result");
    return made;
}

// 0, which is the library's default where nothing is given, as a number next to it.
double given_or_default(const std::optional<double>& value) {
    if (!value) return 0;
    return *value == 0 ? std::numeric_limits<double>::min() : *value;
}

defrec_registration_desc desc_of(const RegisterOptions& given, const Transform& start,
                                 const MeshFile& model, const SurfaceFile& surface) {
    auto desc = initialised<defrec_registration_desc>();
    if (!given.is_tracked_camera) desc.flags |= DEFREC_REGISTRATION_NO_CAMERA;
    if (given.is_deformed) desc.flags |= DEFREC_REGISTRATION_ELASTIC;
    desc.deformation_mm = given_or_default(given.deformation_mm);
    desc.model_vertices = model.vertices.data();
    desc.model_vertex_count = model.vertices.size() / 3;
    desc.model_triangles = model.triangles.data();
    desc.model_triangle_count = model.triangles.size() / 3;
    if (given.seen_template.empty()) {
        desc.seen_vertices = surface.places.data();
        desc.seen_count = surface.places.size() / 3;
    }
    if (!surface.normals.empty()) desc.seen_normals = surface.normals.data();
    if (!surface.covariances.empty()) desc.seen_covariances = surface.covariances.data();
    std::copy(start.begin(), start.end(), desc.start);
    desc.max_turn_rad = given_or_default(given.start_turn_degrees) * kDegree;
    desc.max_shift_mm = given_or_default(given.start_shift_mm);
    desc.starts = given.starts.value_or(0);
    desc.point_error_mm = given_or_default(given.point_error_mm);
    desc.model_error_mm = given_or_default(given.model_error_mm);
    desc.max_residual_mm = given_or_default(given.max_residual_mm);
    desc.max_error_mm = given_or_default(given.max_error_mm);
    return desc;
}

}  // namespace

Registered register_by_pairs(const PairsFile& pairs, const RegisterOptions& options) {
    auto desc = initialised<defrec_registration_pairs>();
    desc.model_xyz = pairs.model_xyz.data();
    desc.seen_xyz = pairs.seen_xyz.data();
    desc.model_covariance = pairs.model_covariance.data();
    desc.seen_covariance = pairs.seen_covariance.data();
    desc.count = pairs.ids.size();
    desc.max_residual_mm = given_or_default(options.max_residual_mm);
    desc.max_error_mm = given_or_default(options.max_error_mm);
    defrec_registration made = nullptr;
    expect_accepted(defrec_registration_from_pairs(&desc, &made), options.pairs);
    return registered(made);
}

Registered register_by_surface(const Context& context, const SurfaceInput& input,
                               const Transform& start, const RegisterOptions& options) {
    const defrec_registration_desc desc = desc_of(options, start, input.model, input.surface);
    defrec_registration made = nullptr;
    const defrec_status status =
        input.seen
            ? defrec_registration_from_template(context.get(), input.seen.get(), &desc, &made)
            : defrec_registration_from_surface(context.get(), &desc, &made);
    const bool is_model_at_fault =
        status < 0 && std::string_view(defrec_last_error()).starts_with("the model");
    const std::string& surface_file = input.seen ? options.seen_template : options.surface;
    expect_accepted(status, is_model_at_fault ? options.model : surface_file);
    return registered(made);
}

}  // namespace defrec::cli
