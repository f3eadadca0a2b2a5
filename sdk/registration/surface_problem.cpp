// See surface_problem.hpp.
#include "sdk/registration/surface_problem.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sdk/base/util/error.hpp"
#include "sdk/contract/descs.hpp"
#include "sdk/registration/decisions.hpp"

namespace defrec {
namespace {

using decisions::RegistrationVerdicts;
using decisions::SurfaceSearch;

Eigen::Matrix3d covariance_at(const SeenSurface& seen, size_t i, double error_mm) {
    if (seen.covariances.empty()) return Eigen::Matrix3d::Identity() * error_mm * error_mm;
    Eigen::Matrix3d made = symmetric_matrix(&seen.covariances[6 * i]);
    const Eigen::Vector3d values =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(made).eigenvalues();
    if (!made.allFinite() || values[2] <= 0 ||
        values[0] < -RegistrationVerdicts::kRounding * values[2])
        fail(DEFREC_ERROR_ARGUMENT, "point ", i,
             ": its covariance is none, expected positive eigenvalues, mm^2");
    // No point is so exact that it holds all the others.
    made.diagonal().array() += SurfaceSearch::kMinPointError * SurfaceSearch::kMinPointError;
    return made;
}

std::vector<SeenPoint> seen_points(const SeenSurface& seen, double error_mm) {
    const size_t count = seen.places.size() / 3;
    if ((!seen.normals.empty() && seen.normals.size() != 3 * count) ||
        (!seen.covariances.empty() && seen.covariances.size() != 6 * count))
        fail(DEFREC_ERROR_ARGUMENT, "there are ", count, " points, ", seen.normals.size() / 3,
             " normals and ", seen.covariances.size() / 6,
             " covariances, expected as many of each, or none");
    if (count < SurfaceSearch::kMinPoints)
        fail(DEFREC_ERROR_ARGUMENT, count, " points of the surface were given, expected ",
             SurfaceSearch::kMinPoints, " at least");
    std::vector<SeenPoint> points(count);
    for (size_t i = 0; i < count; ++i) {
        const Eigen::Map<const Eigen::Vector3f> place(&seen.places[3 * i]);
        if (!place.allFinite())
            fail(DEFREC_ERROR_ARGUMENT, "point ", i, " has a coordinate that is not finite");
        if (const float farthest = place.cwiseAbs().maxCoeff(); farthest > SurfaceSearch::kFarthest)
            fail(DEFREC_ERROR_ARGUMENT, "point ", i, ": a coordinate is ", farthest,
                 " mm from 0, expected ", SurfaceSearch::kFarthest, " at most");
        points[i].place = place.cast<double>();
        points[i].covariance = covariance_at(seen, i, error_mm);
        points[i].normal.setZero();
        if (seen.normals.empty()) continue;
        const Eigen::Vector3d normal =
            Eigen::Map<const Eigen::Vector3f>(&seen.normals[3 * i]).cast<double>();
        if (!normal.allFinite())
            fail(DEFREC_ERROR_ARGUMENT, "point ", i, " has a normal that is not finite");
        if (!normal.isZero(0)) points[i].normal = normal.normalized();
    }
    return points;
}

void check_places(const SurfaceOptions& options) {
    const Eigen::Matrix3d& r = options.start.rotation;
    if (!r.allFinite() || !options.start.translation.allFinite() ||
        !(r * r.transpose()).isIdentity(decisions::RegistrationStart::kRotation) ||
        r.determinant() < 0)
        fail(DEFREC_ERROR_ARGUMENT,
             "the start is no rigid motion, expected a rotation and a finite shift");
    if (options.viewer && !options.viewer->allFinite())
        fail(DEFREC_ERROR_ARGUMENT, "the camera's place is not finite");
}

}  // namespace

SurfaceOptions::SurfaceOptions() {
    defrec_registration_desc desc{};
    fill_defaults(desc);
    start_turn = desc.max_turn_rad;
    start_shift_mm = desc.max_shift_mm;
    starts = desc.starts;
    point_error_mm = desc.point_error_mm;
    model_error_mm = desc.model_error_mm;
    max_residual_mm = desc.max_residual_mm;
    min_inlier_share = desc.min_inlier_share;
    max_error_mm = desc.max_error_mm;
}

SurfaceProblem::SurfaceProblem(const ModelSurface& its_model, const SeenSurface& seen,
                               const SurfaceOptions& options)
    : model(its_model), viewer(options.viewer), model_error_mm(options.model_error_mm) {
    check_places(options);
    points = seen_points(seen, options.point_error_mm);
    const auto count = static_cast<double>(points.size());
    for (const SeenPoint& point : points) centre += point.place / count;
    double squared = 0;
    for (const SeenPoint& point : points) squared += (point.place - centre).squaredNorm() / count;
    length = std::max(std::sqrt(squared), SurfaceSearch::kMinLength);
}

}  // namespace defrec
