// See elastic_registration.hpp.
#include "sdk/registration/elastic/elastic_registration.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "sdk/base/os/helped_loop.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/registration/decisions.hpp"
#include "sdk/registration/elastic/elastic_fit.hpp"
#include "sdk/registration/elastic/elastic_shape.hpp"
#include "sdk/registration/surface_verdict.hpp"

namespace defrec {
namespace {

using decisions::DeformationVerdicts;

float shown(double value) { return static_cast<float>(std::round(100 * value) / 100); }

// From each of the poses that the rigid registration found; the best first.
std::vector<ElasticFit> fits_of(const SurfaceProblem& problem, const ForceModes& modes,
                                double deformation_mm, const Registration& rigid,
                                const Services* helpers) {
    std::vector<Pose> starts{rigid.pose};
    for (const RegistrationAlternative& other : rigid.alternatives) starts.push_back(other.pose);
    std::vector<std::optional<ElasticFit>> made(starts.size());
    helped_loop(helpers, starts.size(), [&](size_t i) {
        made[i].emplace(problem, modes, deformation_mm, starts[i]);
        made[i]->run();
    });
    std::vector<ElasticFit> fits;
    double scale = std::numeric_limits<double>::infinity();
    for (std::optional<ElasticFit>& fit : made) {
        scale = std::min(scale, fit->matches().quality().scale);
        fits.push_back(std::move(*fit));
    }
    std::stable_sort(fits.begin(), fits.end(), [&](const ElasticFit& a, const ElasticFit& b) {
        return a.matches().quality(scale).cost < b.matches().quality(scale).cost;
    });
    return fits;
}

// Root mean square by which places of the model that are matched lie elsewhere by another fit; 0:
// none is matched.
double distance(const ElasticFit& one, const ElasticFit& other) {
    double squared = 0, count = 0;
    const auto vertex = [](const ElasticFit& fit, size_t i) {
        return fit.pose() *
               Eigen::Map<const Eigen::Vector3f>(&fit.vertices()[3 * i]).cast<double>();
    };
    const SurfaceProblem& problem = *one.matches().problem;
    for (const uint32_t triangle : one.matches().triangle) {
        if (triangle == SurfaceMatches::kNoTriangle) continue;
        const size_t corner = problem.model.triangles()[3 * size_t{triangle}];
        squared += (vertex(one, corner) - vertex(other, corner)).squaredNorm();
        ++count;
    }
    return count > 0 ? std::sqrt(squared / count) : 0;
}

void add_alternatives(const std::vector<ElasticFit>& fits, Registration& result) {
    const double scale = result.residuals.error_ratio;
    const double limit =
        decisions::RegistrationVerdicts::kLikeCost * fits.front().matches().quality(scale).cost;
    result.alternatives.clear();
    for (size_t i = 1; i < fits.size(); ++i) {
        const SurfaceFitQuality quality = fits[i].matches().quality(scale);
        const double apart = distance(fits.front(), fits[i]);
        if (apart < decisions::RegistrationVerdicts::kOtherPose || quality.cost > limit) continue;
        result.alternatives.push_back(
            {fits[i].pose(), apart, quality.rms_mm, quality.inlier_share});
    }
}

void tell_size(const ElasticFit& fit, const ForceModes& modes, ModelDeformation& told) {
    const std::span<const float> rest = fit.matches().problem->model.vertices();
    double squared = 0;
    for (size_t i = 0; i < rest.size(); i += 3) {
        const double length =
            static_cast<double>((Eigen::Map<const Eigen::Vector3f>(&fit.vertices()[i]) -
                                 Eigen::Map<const Eigen::Vector3f>(&rest[i]))
                                    .norm());
        squared += length * length;
        told.max_mm = std::max(told.max_mm, length);
    }
    told.rms_mm = std::sqrt(3 * squared / static_cast<double>(rest.size()));
    told.largest_strain = modes.largest_strain(fit.node_shifts());
}

// The covariance with the twist about the frame's origin.
Eigen::MatrixXd about_origin(const SurfaceProblem& problem, const Eigen::MatrixXd& covariance) {
    Eigen::MatrixXd made = covariance;
    const TwistMatrix to_origin = twist_to_origin(problem.centre, problem.length);
    made.topRows<6>() = to_origin * covariance.topRows<6>();
    made.leftCols<6>() = (made.leftCols<6>() * to_origin.transpose()).eval();
    return made;
}

Registration conclude(const std::vector<ElasticFit>& fits,
                      const std::shared_ptr<const ForceModes>& modes, const SurfaceOptions& options,
                      const Registration& rigid) {
    const ElasticFit& best = fits.front();
    const SurfaceMatches& matches = best.matches();
    const SurfaceProblem& problem = *matches.problem;
    Registration result;
    result.pose = best.pose();
    tell_residuals(matches, best.match_all(), best.correlated(), options, result);
    double whole = 0;
    PoseInformation information =
        matches.information(result.residuals.error_ratio, Twist::RowsAtCompileTime, whole);
    information.variance_scale = best.variance_scale();
    // As if the shape were known: which motions of it are open.
    const PoseUncertainty uncertainty =
        uncertainty_of(information, whole, least_open_share(problem.model), options.max_error_mm);
    result.free = uncertainty.free;
    add_alternatives(fits, result);
    judge(options, uncertainty.worst_mm, result);
    const Eigen::MatrixXd covariance = about_origin(problem, best.posterior().covariance);
    result.covariance = covariance.topLeftCorner<6, 6>();
    result.deformation.rigid_rms_mm = rigid.residuals.rms_mm;
    result.deformation.rigid_robust_mm = rigid.residuals.robust_mm;
    tell_size(best, *modes, result.deformation);
    result.deformation.shape = std::make_shared<const ElasticShape>(
        ElasticShape::Parts{modes, best.posterior().shape, covariance, best.seen_at_rest(),
                            modes->rms_strain(best.node_shifts())});
    return result;
}

// The motion that takes places from one pose to another, about the frame's origin, to first order.
Twist twist_between(const Pose& from, const Pose& to) {
    const Eigen::Matrix3d turn = to.rotation * from.rotation.transpose();
    const Eigen::AngleAxisd angle(turn);
    Twist twist;
    twist << angle.angle() * angle.axis(), to.translation - turn * from.translation;
    return twist;
}

// Adds the doubt about the rigid motion that a fit leaves which is not taken: its covariance, and
// the whole of what it would have changed.
void add_doubt(const ElasticFit& fit, const std::shared_ptr<const ForceModes>& modes,
               Registration& rigid) {
    const ShapePosterior& posterior = fit.posterior();
    Eigen::VectorXd change(posterior.covariance.rows());
    change << twist_between(rigid.pose, fit.pose()), posterior.shape;
    const Eigen::MatrixXd covariance =
        about_origin(*fit.matches().problem, posterior.covariance) + change * change.transpose();
    rigid.covariance = covariance.topLeftCorner<6, 6>();
    rigid.deformation.shape = std::make_shared<const ElasticShape>(
        ElasticShape::Parts{modes, Eigen::VectorXd::Zero(posterior.shape.size()), covariance,
                            fit.seen_at_rest(), modes->rms_strain(fit.node_shifts())});
}

Registration refused(Registration rigid, const std::string& reason) {
    rigid.deformation.verdict = DeformationVerdict::kRefused;
    rigid.deformation.reason = reason;
    rigid.deformation.rigid_rms_mm = rigid.residuals.rms_mm;
    rigid.deformation.rigid_robust_mm = rigid.residuals.robust_mm;
    return rigid;
}

// Why a deformation is not taken; empty: it is.
std::string objection(const Registration& elastic, const Registration& rigid, double evidence,
                      double deformation_mm) {
    const ModelDeformation& found = elastic.deformation;
    if (elastic.verdict != RegistrationVerdict::kRegistered &&
        elastic.verdict != RegistrationVerdict::kAmbiguous)
        return "no deformation is determined: " + elastic.reason;
    if (evidence < DeformationVerdicts::kMinEvidence ||
        elastic.residuals.robust_mm >= rigid.residuals.robust_mm)
        return concat("the rigid motion explains the surface as well: residuals of ",
                      shown(rigid.residuals.robust_mm), " mm without a deformation and ",
                      shown(elastic.residuals.robust_mm), " mm with one");
    if (found.rms_mm > deformation_mm)
        return concat("the deformation would be ", shown(found.rms_mm),
                      " mm, root mean square, expected ", shown(deformation_mm), " at most");
    if (found.largest_strain > DeformationVerdicts::kMaxStrain)
        return concat("the tissue would be strained by ", shown(found.largest_strain),
                      ", expected ", shown(DeformationVerdicts::kMaxStrain), " at most");
    return {};
}

}  // namespace

Registration deformed(Registration rigid, const std::shared_ptr<const ForceModes>& modes,
                      const SurfaceProblem& problem, const SurfaceOptions& options,
                      double deformation_mm, const Services* helpers) {
    // A camera inside the model sees no front of a triangle. Where points were matched a failure of
    // the rigid motion is no objection: large deformations make it fail.
    if (std::all_of(rigid.residual_mm.begin(), rigid.residual_mm.end(),
                    [](float residual) { return std::isnan(residual); }))
        return refused(std::move(rigid),
                       "no point was matched to the model, so nothing says how it is deformed");
    const std::vector<ElasticFit> fits = fits_of(problem, *modes, deformation_mm, rigid, helpers);
    Registration elastic = conclude(fits, modes, options, rigid);
    const std::string against =
        objection(elastic, rigid, fits.front().posterior().evidence, deformation_mm);
    if (against.empty()) {
        elastic.deformation.verdict = DeformationVerdict::kApplied;
        elastic.deformation.reason = concat(
            "the model is deformed by ", shown(elastic.deformation.rms_mm),
            " mm, root mean square: the residuals fall from ", shown(rigid.residuals.robust_mm),
            " to ", shown(elastic.residuals.robust_mm), " mm");
        return elastic;
    }
    // Motions that are open are in doubt by more.
    if (rigid.free.empty()) add_doubt(fits.front(), modes, rigid);
    return refused(std::move(rigid), against);
}

Registration register_elastic(const ModelSurface& model, const SeenSurface& seen,
                              const SurfaceOptions& options, double deformation_mm,
                              const Services* helpers) {
    const auto modes = std::make_shared<const ForceModes>(model, helpers);
    return deformed(register_surface(model, seen, options, helpers), modes,
                    SurfaceProblem(model, seen, options), options, deformation_mm, helpers);
}

}  // namespace defrec
