// See surface_matches.hpp.
#include "sdk/registration/surface_matches.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/base/util/median.hpp"
#include "sdk/registration/decisions.hpp"

namespace defrec {
namespace {

using decisions::SurfaceKernel;

// 0 at the centre, 1 for outliers.
double tukey_cost(double ratio) {
    const double x = ratio / SurfaceKernel::kTukey;
    const double left = std::max(1 - x * x, 0.0);
    return 1 - left * left * left;
}

}  // namespace

double tukey_weight(double ratio) {
    const double x = ratio / SurfaceKernel::kTukey;
    const double left = 1 - x * x;
    return left > 0 ? left * left : 0;
}

SurfaceMatches::SurfaceMatches(const SurfaceProblem& its_problem, size_t its_step)
    : problem(&its_problem),
      step(its_step),
      all((its_problem.points.size() + its_step - 1) / its_step),
      triangle(all.size(), kNoTriangle) {}

void SurfaceMatches::find(const TriangleTree& tree, const Pose& pose) {
    const Pose to_model = pose.inverse();
    const bool is_seen_from = problem->viewer && problem->model.has_outside();
    const Eigen::Vector3d viewer =
        is_seen_from ? to_model * *problem->viewer : Eigen::Vector3d::Zero();
    for (size_t i = 0; i < all.size(); ++i) {
        const SeenPoint& point = problem->points[i * step];
        SurfaceMatch& match = all[i];
        const auto nearest =
            tree.nearest(to_model * point.place, is_seen_from ? &viewer : nullptr, triangle[i]);
        match.is_valid = nearest.has_value();
        if (!nearest) continue;
        triangle[i] = nearest->triangle;
        match.place = pose * nearest->place;
        match.normal = pose.rotation * tree.normal(nearest->triangle);
        match.residual = match.normal.dot(point.place - match.place);
        match.expected = std::sqrt(match.normal.dot(point.covariance * match.normal) +
                                   problem->model_error_mm * problem->model_error_mm);
        const double agreement = match.normal.dot(point.normal);
        match.is_valid = point.normal.isZero(0) ||
                         (problem->model.has_outside() ? agreement : std::abs(agreement)) >=
                             SurfaceKernel::kMinAgreement;
    }
}

Twist SurfaceMatches::gradient(const SurfaceMatch& match) const {
    Twist made;
    made << (match.place - problem->centre).cross(match.normal) / problem->length, match.normal;
    return made;
}

double SurfaceMatches::robust_scale() const {
    std::vector<double> ratios;
    ratios.reserve(all.size());
    for (const SurfaceMatch& match : all)
        if (match.is_valid) ratios.push_back(std::abs(match.residual) / match.expected);
    return std::max(SurfaceKernel::kMedianToSigma * median(std::move(ratios)),
                    SurfaceKernel::kMinScale);
}

std::vector<double> SurfaceMatches::weights(double scale) const {
    std::vector<double> made(all.size());
    for (size_t i = 0; i < made.size(); ++i)
        made[i] = all[i].is_valid ? tukey_weight(all[i].residual / (all[i].expected * scale)) : 0;
    return made;
}

SurfaceFitQuality SurfaceMatches::quality(double scale) const {
    SurfaceFitQuality quality;
    quality.scale = robust_scale();
    if (scale == 0) scale = quality.scale;
    std::vector<double> lengths;
    double squared = 0, inliers = 0;
    for (const SurfaceMatch& match : all) {
        if (!match.is_valid) {
            quality.cost += 1;
            continue;
        }
        const double ratio = match.residual / (match.expected * scale);
        quality.cost += tukey_cost(ratio);
        lengths.push_back(std::abs(match.residual));
        if (std::abs(ratio) > SurfaceKernel::kInlier) continue;
        squared += match.residual * match.residual;
        ++inliers;
    }
    const auto count = static_cast<double>(all.size());
    quality.robust_mm = SurfaceKernel::kMedianToSigma * median(std::move(lengths));
    quality.rms_mm = inliers > 0 ? std::sqrt(squared / inliers) : 0;
    quality.inlier_share = inliers / count;
    quality.cost /= count;
    return quality;
}

PoseInformation SurfaceMatches::information(double scale, double parameters, double& whole) const {
    PoseInformation made;
    made.centre = problem->centre;
    made.length = problem->length;
    whole = 0;
    // An M-estimator's covariance (Huber, Robust Statistics, 1981, 7.6): psi^2 and psi' stand in
    // for the residuals' squares and for 1.
    double psi_squared = 0, slope = 0, used = 0;
    for (const SurfaceMatch& match : all) {
        if (!match.is_valid) continue;
        const double ratio = match.residual / (match.expected * scale);
        const double weight = tukey_weight(ratio);
        if (weight == 0) continue;
        const double part = ratio / SurfaceKernel::kTukey;
        psi_squared += weight * weight * ratio * ratio;
        slope += (1 - part * part) * (1 - 5 * part * part);
        ++used;
        made.add(gradient(match), 1 / (match.expected * match.expected));
        whole += 1 / (match.expected * match.expected);
    }
    const double freedom = used - parameters;
    if (freedom <= 0 || slope <= 0) return made;
    made.variance_scale =
        scale * scale * (psi_squared / freedom) / ((slope / used) * (slope / used));
    return made;
}

}  // namespace defrec
