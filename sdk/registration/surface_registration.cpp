// See surface_registration.hpp. Every start approaches with a few of the points; the best of those
// that end at different poses are refined with all. The covariance is the inverse of the normal
// equations at the minimum, which is the leading part of Censi's closed form for ICP (An accurate
// closed-form estimate of ICP's covariance, ICRA 2007), scaled by the residuals and by how many
// neighbours share an error.
#include "sdk/registration/surface_registration.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "sdk/base/os/helped_loop.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/contract/descs.hpp"
#include "sdk/registration/decisions.hpp"
#include "sdk/registration/residual_correlation.hpp"
#include "sdk/registration/starts.hpp"
#include "sdk/registration/surface_fit.hpp"

namespace defrec {
namespace {

using decisions::RegistrationVerdicts;
using decisions::SurfaceSearch;

float shown(double value) { return static_cast<float>(std::round(100 * value) / 100); }
float percent(double share) { return static_cast<float>(std::round(100 * share)); }

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
        points[i].place = Eigen::Map<const Eigen::Vector3f>(&seen.places[3 * i]).cast<double>();
        if (!points[i].place.allFinite())
            fail(DEFREC_ERROR_ARGUMENT, "point ", i, " has a coordinate that is not finite");
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

class Search {
  public:
    Search(const ModelSurface& model, const SeenSurface& seen, const SurfaceOptions& options,
           const Services* helpers)
        : options_(options),
          helpers_(helpers),
          problem_{model,
                   seen_points(seen, options.point_error_mm),
                   options.viewer,
                   options.model_error_mm,
                   Eigen::Vector3d::Zero(),
                   1} {
        const auto count = static_cast<double>(problem_.points.size());
        for (const SeenPoint& point : problem_.points) problem_.centre += point.place / count;
        double squared = 0;
        for (const SeenPoint& point : problem_.points)
            squared += (point.place - problem_.centre).squaredNorm() / count;
        problem_.length = std::max(std::sqrt(squared), SurfaceSearch::kMinLength);
    }

    Registration run() {
        std::vector<SurfaceFit> fits =
            refined(approached(), step_for(SurfaceSearch::kRefinePoints));
        rank(fits);
        fits = refined(worth_refining(fits), step_for(SurfaceSearch::kMaxPoints));
        rank(fits);
        return conclude(fits);
    }

  private:
    size_t step_for(size_t most) const { return (problem_.points.size() + most - 1) / most; }

    // Where the starts end, the best first, each pose once.
    std::vector<Pose> approached() const {
        const std::vector<Pose> starts =
            spread_starts(options_.start, problem_.centre, options_.start_turn,
                          options_.start_shift_mm, options_.starts);
        std::vector<Pose> ends(starts.size());
        std::vector<double> cost(starts.size());
        const size_t step = step_for(SurfaceSearch::kApproachPoints);
        helped_loop(helpers_, starts.size(), [&](size_t i) {
            SurfaceFit fit(problem_, starts[i], step);
            fit.approach();
            ends[i] = fit.pose();
            cost[i] = fit.wide_cost();
        });
        std::vector<size_t> order(starts.size());
        std::iota(order.begin(), order.end(), size_t{0});
        std::stable_sort(order.begin(), order.end(),
                         [&](size_t a, size_t b) { return cost[a] < cost[b]; });
        std::vector<Pose> distinct;
        for (const size_t i : order) {
            const bool is_new = std::none_of(distinct.begin(), distinct.end(), [&](const Pose& p) {
                return distance(p, ends[i]) < SurfaceSearch::kSamePose;
            });
            if (is_new && distinct.size() < SurfaceSearch::kCandidates) distinct.push_back(ends[i]);
        }
        return distinct;
    }

    std::vector<SurfaceFit> refined(const std::vector<Pose>& poses, size_t step) const {
        std::vector<std::optional<SurfaceFit>> made(poses.size());
        helped_loop(helpers_, poses.size(), [&](size_t i) {
            made[i].emplace(problem_, poses[i], step);
            made[i]->refine();
        });
        std::vector<SurfaceFit> fits;
        for (std::optional<SurfaceFit>& fit : made) fits.push_back(std::move(*fit));
        return fits;
    }

    // fits: the best first.
    static std::vector<Pose> worth_refining(const std::vector<SurfaceFit>& fits) {
        const double scale = fits.front().quality().scale;
        const double most = SurfaceSearch::kWorthRefining * fits.front().quality(scale).cost;
        std::vector<Pose> poses;
        for (const SurfaceFit& fit : fits)
            if (poses.empty() || fit.quality(scale).cost <= most) poses.push_back(fit.pose());
        return poses;
    }

    // The best first, all judged by one scale.
    static void rank(std::vector<SurfaceFit>& fits) {
        double scale = std::numeric_limits<double>::infinity();
        for (const SurfaceFit& fit : fits) scale = std::min(scale, fit.quality().scale);
        std::stable_sort(fits.begin(), fits.end(), [&](const SurfaceFit& a, const SurfaceFit& b) {
            return a.quality(scale).cost < b.quality(scale).cost;
        });
    }

    // Root mean square by which the points move from one pose of the model to another.
    double distance(const Pose& a, const Pose& b) const {
        const Pose to_model = a.inverse();
        const size_t step = step_for(SurfaceSearch::kDistancePoints);
        double squared = 0, count = 0;
        for (size_t i = 0; i < problem_.points.size(); i += step, ++count) {
            const Eigen::Vector3d& place = problem_.points[i].place;
            squared += (b * (to_model * place) - place).squaredNorm();
        }
        return std::sqrt(squared / count);
    }

    Registration conclude(const std::vector<SurfaceFit>& fits) const {
        const SurfaceFit& best = fits.front();
        const SurfaceFitQuality quality = best.quality();
        Registration result;
        result.pose = best.pose();
        double whole = 0;
        PoseInformation information = best.information(quality.scale, whole);
        const double correlated = correlation(best, quality.scale);
        // As far as the model's error shows, the residuals hold it already.
        information.variance_scale =
            std::max(information.variance_scale * correlated, model_share(best));
        const PoseUncertainty uncertainty =
            uncertainty_of(information, whole, min_share(), options_.max_error_mm);
        result.covariance = uncertainty.covariance;
        result.free = uncertainty.free;
        result.residuals = {quality.rms_mm,     quality.robust_mm, quality.scale,
                            inlier_share(best), correlated,        best.matches().size()};
        tell_residuals(result);
        add_alternatives(result, fits);
        judge(result, uncertainty.worst_mm);
        return result;
    }

    // Points within kInlier times the scale that still would be good enough.
    double inlier_share(const SurfaceFit& fit) const {
        double count = 0;
        const double scale = fit.quality().scale;
        for (const SurfaceMatch& match : fit.matches())
            count += match.is_valid && is_inlier(match, scale);
        return count / static_cast<double>(fit.matches().size());
    }
    bool is_inlier(const SurfaceMatch& match, double scale) const {
        const double sigma = std::min(match.expected * scale, options_.max_residual_mm);
        return std::abs(match.residual) <= decisions::SurfaceKernel::kInlier * sigma;
    }

    // The model's own error is one for all points of a part of the surface, so that more points do
    // not lessen it: the variance scale that it gives.
    double model_share(const SurfaceFit& fit) const {
        const double area = 2 * std::numbers::pi * problem_.length * problem_.length;
        const double parts = std::max(
            1.0, area / (SurfaceSearch::kModelErrorLength * SurfaceSearch::kModelErrorLength));
        double squared = 0, count = 0;
        for (const SurfaceMatch& match : fit.matches()) {
            if (!match.is_valid) continue;
            squared += match.expected * match.expected;
            ++count;
        }
        if (count == 0) return 0;
        const double error = options_.model_error_mm;
        return error * error * count / (squared / count * parts);
    }

    static double correlation(const SurfaceFit& fit, double scale) {
        std::vector<Eigen::Vector3d> places;
        std::vector<double> values;
        for (const SurfaceMatch& match : fit.matches()) {
            const double value = match.residual / (match.expected * scale);
            if (!match.is_valid || std::abs(value) > decisions::SurfaceKernel::kInlier) continue;
            places.push_back(match.place);
            values.push_back(value);
        }
        return design_effect(places, values);
    }

    // Facets turn normals by about half the angle between them: motions that the smooth surface
    // leaves open look as if something held them.
    double min_share() const {
        const double angle =
            std::max(problem_.model.findings().facet_angle * decisions::FreeMotions::kFacetShare,
                     decisions::FreeMotions::kMinAngle);
        return angle * angle;
    }

    void tell_residuals(Registration& result) const {
        SurfaceFit all(problem_, result.pose, 1);
        const double scale = result.residuals.error_ratio;
        for (const SurfaceMatch& match : all.matches()) {
            result.residual_mm.push_back(match.is_valid ? static_cast<float>(match.residual)
                                                        : std::numeric_limits<float>::quiet_NaN());
            result.is_inlier.push_back(match.is_valid && is_inlier(match, scale));
        }
    }

    void add_alternatives(Registration& result, const std::vector<SurfaceFit>& fits) const {
        const double scale = result.residuals.error_ratio;
        const double cost = fits.front().quality(scale).cost;
        // Costs of poses that fit alike differ by chance: a unit of chi^2 is Tukey's c^2 / 6.
        const double c = decisions::SurfaceKernel::kTukey;
        const double chance = RegistrationVerdicts::kChiSquared * result.residuals.correlated * 3 /
                              (c * c * static_cast<double>(result.residuals.used));
        const double limit = std::max(cost * RegistrationVerdicts::kLikeCost, cost + chance);
        std::vector<Pose> told{result.pose};
        for (size_t i = 1; i < fits.size(); ++i) {
            const SurfaceFitQuality quality = fits[i].quality(scale);
            const bool is_new = std::none_of(told.begin(), told.end(), [&](const Pose& pose) {
                return distance(pose, fits[i].pose()) < RegistrationVerdicts::kOtherPose;
            });
            if (!is_new || quality.cost > limit) continue;
            told.push_back(fits[i].pose());
            result.alternatives.push_back({fits[i].pose(), distance(result.pose, fits[i].pose()),
                                           quality.rms_mm, quality.inlier_share});
        }
    }

    void judge(Registration& result, double worst_mm) const {
        const RegistrationResiduals& residuals = result.residuals;
        result.verdict = RegistrationVerdict::kFailed;
        if (residuals.robust_mm > options_.max_residual_mm) {
            result.reason =
                concat("no pose fits: the points are off by ", shown(residuals.robust_mm),
                       " mm, expected ", shown(options_.max_residual_mm), " at most");
        } else if (residuals.inlier_share < options_.min_inlier_share) {
            result.reason = concat("no pose fits: ", percent(residuals.inlier_share),
                                   " % of the points lie on the model, expected ",
                                   percent(options_.min_inlier_share), " at least");
        } else if (residuals.error_ratio > RegistrationVerdicts::kMaxRatio) {
            result.reason = concat(
                "no pose fits: the points are off by ", shown(residuals.robust_mm), " mm, ",
                shown(residuals.error_ratio), " times what the errors that are stated explain");
        } else if (!result.free.empty()) {
            result.verdict = RegistrationVerdict::kUndetermined;
            result.reason = "the surface that is seen leaves open: ";
            for (size_t i = 0; i < result.free.size(); ++i)
                result.reason += (i > 0 ? "; " : "") + result.free[i].text();
        } else if (!result.alternatives.empty()) {
            const RegistrationAlternative& other = result.alternatives.front();
            result.verdict = RegistrationVerdict::kAmbiguous;
            result.reason =
                concat("another pose, ", shown(other.distance_mm), " mm away, fits as well: to ",
                       shown(other.rms_mm), " mm, this one to ", shown(residuals.rms_mm));
        } else {
            result.verdict = RegistrationVerdict::kRegistered;
            result.reason = concat(percent(residuals.inlier_share), " % of the points fit to ",
                                   shown(residuals.rms_mm), " mm, and hold every motion to ",
                                   shown(worst_mm), " mm");
        }
    }

    const SurfaceOptions& options_;
    const Services* helpers_;
    SurfaceProblem problem_;
};

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

Registration register_surface(const ModelSurface& model, const SeenSurface& seen,
                              const SurfaceOptions& options, const Services* helpers) {
    check_places(options);
    return Search(model, seen, options, helpers).run();
}

}  // namespace defrec
