// The exported functions for registrations of a preoperative model: check, catch, forward.
#include <array>
#include <cmath>

#include "sdk/api/call.hpp"
#include "sdk/api/objects.hpp"
#include "sdk/api/read.hpp"
#include "sdk/api/verdict.hpp"
#include "sdk/registration/decisions.hpp"
#include "sdk/registration/elastic/elastic_registration.hpp"
#include "sdk/registration/point_pairs.hpp"
#include "sdk/registration/surface_registration.hpp"
#include "sdk/tracking/evidence/template_error.hpp"

using namespace defrec;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Eigen::Vector3d place_at(std::span<const double> xyz, size_t i) {
    return Eigen::Map<const Eigen::Vector3d>(&xyz[3 * i]);
}

// values: six each; empty: 0.
Eigen::Matrix3d covariance_at(std::span<const double> values, size_t i) {
    if (values.empty()) return Eigen::Matrix3d::Zero();
    return symmetric_matrix(&values[6 * i]);
}

defrec_registration add(std::shared_ptr<RegistrationObject> object) {
    for (const FreeMotion& motion : object->found.free) object->free_texts.push_back(motion.text());
    return add_handle<defrec_registration>(std::move(object));
}

// The points that count, one after the other, and which of those given they are.
struct CountedPoints {
    std::vector<float> places, normals, covariances;
    std::vector<size_t> index;
    size_t given = 0;
};

// values: so many of each point, or none; those of one point are added.
void add_values(std::span<const float> values, size_t components, size_t i,
                std::vector<float>& added) {
    if (values.empty()) return;
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(components * i);
    added.insert(added.end(), begin, begin + static_cast<std::ptrdiff_t>(components));
}

CountedPoints read_points(const defrec_registration_desc& desc) {
    const auto places = read_array("desc.seen_vertices", desc.seen_vertices, desc.seen_count, 3),
               normals = read_optional(desc.seen_normals, desc.seen_count, 3),
               covariances = read_optional(desc.seen_covariances, desc.seen_count, 6);
    CountedPoints points;
    points.given = static_cast<size_t>(desc.seen_count);
    for (size_t i = 0; i < points.given; ++i) {
        if (desc.seen_status != nullptr && desc.seen_status[i] != DEFREC_POINT_OBSERVED) continue;
        points.index.push_back(i);
        add_values(places, 3, i, points.places);
        add_values(normals, 3, i, points.normals);
        add_values(covariances, 6, i, points.covariances);
    }
    return points;
}

CountedPoints points_of(const TemplateData& surface, bool has_errors) {
    CountedPoints points;
    points.given = surface.vertices.size();
    for (size_t i = 0; i < points.given; ++i) {
        const defrec_surface_point& vertex = surface.vertices[i];
        const auto is_far = [](float value) {
            return std::abs(value) > decisions::SurfaceSearch::kFarthest;
        };
        if (surface.vertex_support[i] != 0 ||
            std::any_of(std::begin(vertex.position), std::end(vertex.position), is_far))
            continue;
        points.index.push_back(i);
        add_values(vertex.position, 3, 0, points.places);
        add_values(vertex.normal, 3, 0, points.normals);
        if (!has_errors)
            add_values(
                stereo_covariance(surface.camera, vertex.position, surface.disparity_sigma_px), 6,
                0, points.covariances);
    }
    return points;
}

// Where all count, the registration looks at how many there are.
void expect_observed(const CountedPoints& points) {
    constexpr size_t kLeast = decisions::SurfaceSearch::kMinPoints;
    if (points.index.size() != points.given && points.index.size() < kLeast)
        fail(DEFREC_ERROR_ARGUMENT, points.index.size(), " of the ", points.given,
             " points of the surface were observed, expected ", kLeast, " at least");
}

SurfaceOptions options_of(const defrec_registration_desc& desc) {
    SurfaceOptions options;
    constexpr auto is_zero = [](double value) { return value == 0; };
    if (!std::all_of(std::begin(desc.start), std::end(desc.start), is_zero)) {
        const Eigen::Isometry3d start = affine_of(desc.start);
        options.start = {start.linear(), start.translation()};
    }
    options.start_turn = desc.max_turn_rad;
    options.start_shift_mm = desc.max_shift_mm;
    options.starts = desc.starts;
    options.viewer = Eigen::Map<const Eigen::Vector3d>(desc.viewer);
    if ((desc.flags & DEFREC_REGISTRATION_NO_CAMERA) != 0) options.viewer.reset();
    options.point_error_mm = desc.point_error_mm;
    options.model_error_mm = desc.model_error_mm;
    options.max_residual_mm = desc.max_residual_mm;
    options.min_inlier_share = desc.min_inlier_share;
    options.max_error_mm = desc.max_error_mm;
    return options;
}

// Per point that was given, instead of per one that counts.
void spread(const CountedPoints& points, Registration& found) {
    std::vector<float> residuals(points.given, std::numeric_limits<float>::quiet_NaN());
    std::vector<uint8_t> inliers(points.given, 0);
    for (size_t i = 0; i < points.index.size(); ++i) {
        residuals[points.index[i]] = found.residual_mm[i];
        inliers[points.index[i]] = found.is_inlier[i];
    }
    found.residual_mm = std::move(residuals);
    found.is_inlier = std::move(inliers);
}

// Covariance of the shift of a template whose disparities are off alike, as the application stated.
Eigen::Matrix3d shift_of_disparity(const TemplateData& surface, const CountedPoints& points) {
    const size_t count = points.places.size() / 3;
    if (surface.disparity_sigma_px == 0 || count == 0) return Eigen::Matrix3d::Zero();
    const Eigen::Vector3f middle = Eigen::Map<const Eigen::Matrix3Xf>(
                                       points.places.data(), 3, static_cast<Eigen::Index>(count))
                                       .rowwise()
                                       .mean();
    const std::array<float, 6> values =
        stereo_covariance(surface.camera, middle.data(), surface.disparity_sigma_px);
    return symmetric_matrix(values.data());
}

defrec_registration register_points(const Context& context, const defrec_registration_desc& desc,
                                    const CountedPoints& points,
                                    const Eigen::Matrix3d& seen_shift = Eigen::Matrix3d::Zero()) {
    expect_observed(points);
    const ModelSurface model(
        read_array("desc.model_vertices", desc.model_vertices, desc.model_vertex_count, 3),
        read_array("desc.model_triangles", desc.model_triangles, desc.model_triangle_count, 3),
        "the model");
    auto object = std::make_shared<RegistrationObject>();
    Services::forget_parallel_failure();
    const SeenSurface seen{points.places, points.normals, points.covariances};
    const bool is_elastic = (desc.flags & DEFREC_REGISTRATION_ELASTIC) != 0;
    object->found = is_elastic
                        ? register_elastic(model, seen, options_of(desc), desc.deformation_mm,
                                           &context.services())
                        : register_surface(model, seen, options_of(desc), &context.services());
    Services::expect_parallel_success("registering the model");
    object->found.add_seen_shift(seen_shift);
    spread(points, object->found);
    object->model = model.findings();
    object->model_has_outside = model.has_outside();
    object->triangles.assign(model.triangles().begin(), model.triangles().end());
    return add(std::move(object));
}

void describe_deformation(const ModelDeformation& found, defrec_registration_info& info) {
    info.deformation = deformation_verdict_of(found.verdict);
    info.deformation_text = found.reason.c_str();
    info.deformed_rms_mm = found.rms_mm;
    info.deformed_max_mm = found.max_mm;
    info.largest_strain = found.largest_strain;
    info.rigid_rms_mm = found.rigid_rms_mm;
    info.rigid_robust_mm = found.rigid_robust_mm;
}

void describe(const RegistrationObject& object, defrec_registration_info& info) {
    const Registration& found = object.found;
    info.struct_size = sizeof info;
    info.verdict = verdict_of(found.verdict);
    info.reason = found.reason.c_str();
    write_motion(found.pose.rotation, found.pose.translation, info.transform);
    write_matrix(found.covariance, info.covariance);
    info.rms_mm = found.residuals.rms_mm;
    info.robust_mm = found.residuals.robust_mm;
    info.error_ratio = found.residuals.error_ratio;
    info.inlier_share = found.residuals.inlier_share;
    info.correlated = found.residuals.correlated;
    info.used = found.residuals.used;
    info.residuals = found.residual_mm.data();
    info.inliers = found.is_inlier.data();
    info.point_count = found.residual_mm.size();
    info.triangles = object.triangles.empty() ? nullptr : object.triangles.data();
    info.triangle_count = object.triangles.size() / 3;
    info.dropped_triangles = object.model.dropped_triangles;
    info.open_edges = object.model.open_edges;
    info.odd_edges = object.model.odd_edges;
    info.model_turned = object.model.was_turned ? 1 : 0;
    info.model_has_outside = object.model_has_outside ? 1 : 0;
    info.free_motion_count = found.free.size();
    info.alternative_count = found.alternatives.size();
    describe_deformation(found.deformation, info);
}

// A place of the model, and what follows for it; outputs may be null. A place so far away that
// what follows is not finite is none.
void move_point(const Registration& found, const double* model_xyz, double* xyz, double* covariance,
                double* expected_error_mm) {
    const Eigen::Vector3d place = Eigen::Map<const Eigen::Vector3d>(model_xyz);
    PlacedPoint placed{Eigen::Vector3d::Constant(kNaN), Eigen::Matrix3d::Constant(kNaN)};
    if (place.allFinite()) {
        const PlacedPoint there = found.placed(place);
        if (there.place.allFinite() && std::isfinite(there.covariance.sum())) placed = there;
    }
    std::copy(placed.place.begin(), placed.place.end(), xyz);
    if (covariance != nullptr) {
        const std::array<double, 6> values = symmetric_values(placed.covariance);
        std::copy(values.begin(), values.end(), covariance);
    }
    if (expected_error_mm != nullptr) *expected_error_mm = std::sqrt(placed.covariance.trace());
}

}  // namespace

extern "C" {

defrec_status defrec_registration_from_pairs(const defrec_registration_pairs* desc,
                                             defrec_registration* out) {
    return api_call([&] {
        expect_given("out", out);
        const auto given = read_complete(desc);
        const auto model = read_array("desc.model_xyz", given.model_xyz, given.count, 3),
                   seen = read_array("desc.seen_xyz", given.seen_xyz, given.count, 3),
                   model_errors = read_optional(given.model_covariance, given.count, 6),
                   seen_errors = read_optional(given.seen_covariance, given.count, 6);
        std::vector<PointPair> pairs(static_cast<size_t>(given.count));
        for (size_t i = 0; i < pairs.size(); ++i)
            pairs[i] = {place_at(model, i), place_at(seen, i), covariance_at(model_errors, i),
                        covariance_at(seen_errors, i)};
        PairOptions options;
        options.max_residual_mm = given.max_residual_mm;
        options.max_error_mm = given.max_error_mm;
        auto object = std::make_shared<RegistrationObject>();
        object->found = register_pairs(pairs, options);
        *out = add(std::move(object));
    });
}

defrec_status defrec_registration_from_surface(defrec_context context,
                                               const defrec_registration_desc* desc,
                                               defrec_registration* out) {
    return api_call([&] {
        expect_given("out", out);
        const auto owner = find_handle(context);
        const auto given = read_complete(desc);
        *out = register_points(*owner, given, read_points(given));
    });
}

defrec_status defrec_registration_from_template(defrec_context context, defrec_template surface,
                                                const defrec_registration_desc* desc,
                                                defrec_registration* out) {
    return api_call([&] {
        expect_given("out", out);
        const auto owner = find_handle(context);
        const auto object = find_handle(surface);
        const bool has_error =
            desc != nullptr &&
            read_struct<defrec_registration_desc>("desc", desc).point_error_mm != 0;
        const auto given = read_complete(desc);
        if (given.seen_count != 0)
            fail(DEFREC_ERROR_ARGUMENT, "desc.seen_count is ", given.seen_count,
                 "; the template's vertices are the points that were seen, 0 expected");
        const TemplateData& data = object->surface->data();
        const CountedPoints points = points_of(data, has_error);
        *out = register_points(*owner, given, points, shift_of_disparity(data, points));
    });
}

void defrec_registration_destroy(defrec_registration registration) {
    if (registration != nullptr) api_call([&] { remove_handle(registration); });
}

defrec_status defrec_registration_get(defrec_registration registration,
                                      defrec_registration_info* out) {
    return api_call([&] {
        const auto object = find_handle(registration);
        defrec_registration_info info{};
        describe(*object, info);
        write_struct(out, info);
    });
}

defrec_status defrec_registration_get_free_motion(defrec_registration registration, size_t index,
                                                  defrec_free_motion* out) {
    return api_call([&] {
        const auto object = find_handle(registration);
        const std::vector<FreeMotion>& motions = object->found.free;
        check_index(index, motions.size(), "free motions");
        const FreeMotion& motion = motions[index];
        defrec_free_motion made{};
        made.struct_size = sizeof made;
        made.kind = motion.is_turn ? DEFREC_FREE_TURN : DEFREC_FREE_SHIFT;
        for (int axis = 0; axis < 3; ++axis) {
            made.axis[axis] = motion.axis[axis];
            made.point[axis] = motion.point[axis];
        }
        made.pitch_mm_per_rad = motion.pitch_mm;
        made.expected_mm = motion.expected_mm;
        made.text = object->free_texts[index].c_str();
        write_struct(out, made);
    });
}

defrec_status defrec_registration_get_alternative(defrec_registration registration, size_t index,
                                                  defrec_registration_alternative* out) {
    return api_call([&] {
        const auto object = find_handle(registration);
        const std::vector<RegistrationAlternative>& others = object->found.alternatives;
        check_index(index, others.size(), "alternatives");
        const RegistrationAlternative& other = others[index];
        defrec_registration_alternative made{};
        made.struct_size = sizeof made;
        write_motion(other.pose.rotation, other.pose.translation, made.transform);
        made.distance_mm = other.distance_mm;
        made.rms_mm = other.rms_mm;
        made.inlier_share = other.inlier_share;
        write_struct(out, made);
    });
}

defrec_status defrec_registration_move_points(defrec_registration registration,
                                              const double* model_xyz, size_t count, double* xyz,
                                              double* covariance, double* expected_error_mm) {
    return api_call([&] {
        const auto object = find_handle(registration);
        check_count(count);
        if (count != 0) {
            expect_given("model_xyz", model_xyz);
            expect_given("xyz", xyz);
        }
        for (size_t i = 0; i < count; ++i)
            move_point(object->found, model_xyz + 3 * i, xyz + 3 * i,
                       covariance == nullptr ? nullptr : covariance + 6 * i,
                       expected_error_mm == nullptr ? nullptr : expected_error_mm + i);
    });
}

}  // extern "C"
