// See surface_fit.hpp. Point to plane (Chen and Medioni, Object modelling by registration of
// multiple range images, Image and Vision Computing 10, 1992): each point pulls along the normal
// of the nearest place of the model, with the variance that its covariance has along it. Weights
// first follow Geman and McClure's function of a width that shrinks from step to step (graduated
// non-convexity: Blake and Zisserman, Visual Reconstruction, 1987), then Tukey's biweight.
#include "sdk/registration/surface_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sdk/base/util/median.hpp"
#include "sdk/registration/decisions.hpp"

namespace defrec {
namespace {

using decisions::SurfaceApproach;
using decisions::SurfaceKernel;

constexpr uint32_t kNoTriangle = std::numeric_limits<uint32_t>::max();

double tukey_weight(double ratio) {
    const double x = ratio / SurfaceKernel::kTukey;
    const double left = 1 - x * x;
    return left > 0 ? left * left : 0;
}

// 0 at the centre, 1 for outliers.
double tukey_cost(double ratio) {
    const double x = ratio / SurfaceKernel::kTukey;
    const double left = std::max(1 - x * x, 0.0);
    return 1 - left * left * left;
}

}  // namespace

SurfaceFit::SurfaceFit(const SurfaceProblem& problem, const Pose& start, size_t step)
    : problem_(&problem),
      step_(step),
      pose_(start),
      matches_((problem.points.size() + step - 1) / step),
      nearest_(matches_.size(), kNoTriangle) {
    match();
}

void SurfaceFit::match() {
    const TriangleTree& tree = problem_->model.tree();
    const Pose to_model = pose_.inverse();
    const bool is_seen_from = problem_->viewer && problem_->model.has_outside();
    const Eigen::Vector3d viewer =
        is_seen_from ? to_model * *problem_->viewer : Eigen::Vector3d::Zero();
    for (size_t i = 0; i < matches_.size(); ++i) {
        const SeenPoint& point = problem_->points[i * step_];
        SurfaceMatch& match = matches_[i];
        const auto nearest =
            tree.nearest(to_model * point.place, is_seen_from ? &viewer : nullptr, nearest_[i]);
        match.is_valid = nearest.has_value();
        if (!nearest) continue;
        nearest_[i] = nearest->triangle;
        match.place = pose_ * nearest->place;
        match.normal = pose_.rotation * tree.normal(nearest->triangle);
        match.residual = match.normal.dot(point.place - match.place);
        match.expected = std::sqrt(match.normal.dot(point.covariance * match.normal) +
                                   problem_->model_error_mm * problem_->model_error_mm);
        const double agreement = match.normal.dot(point.normal);
        match.is_valid = point.normal.isZero(0) ||
                         (problem_->model.has_outside() ? agreement : std::abs(agreement)) >=
                             SurfaceKernel::kMinAgreement;
    }
}

Twist SurfaceFit::gradient(const SurfaceMatch& match) const {
    Twist made;
    made << (match.place - problem_->centre).cross(match.normal) / problem_->length, match.normal;
    return made;
}

double SurfaceFit::move(const std::vector<double>& weights, double damping, bool is_fine) {
    TwistMatrix matrix = TwistMatrix::Zero();
    Twist right = Twist::Zero();
    double sum = 0;
    for (size_t i = 0; i < matches_.size(); ++i) {
        if (weights[i] == 0) continue;
        const SurfaceMatch& match = matches_[i];
        const double weight = is_fine ? weights[i] / (match.expected * match.expected) : weights[i];
        const Twist row = gradient(match);
        matrix.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
        right += weight * match.residual * row;
        sum += weight;
    }
    if (sum == 0) return 0;
    matrix.diagonal().array() += damping * sum;
    Twist step = matrix.selfadjointView<Eigen::Lower>().ldlt().solve(right);
    const double length = step.norm();
    if (length > SurfaceApproach::kMaxStep) step *= SurfaceApproach::kMaxStep / length;
    step.head<3>() /= problem_->length;
    pose_ = moved(pose_, step, problem_->centre);
    match();
    return length;
}

void SurfaceFit::approach() {
    std::vector<double> weights(matches_.size());
    double width = SurfaceApproach::kFirstWidth;
    const double factor =
        std::pow(SurfaceApproach::kLastWidth / width, 1.0 / (SurfaceApproach::kRounds - 1));
    for (int round = 0; round < SurfaceApproach::kRounds; ++round, width *= factor) {
        for (size_t i = 0; i < weights.size(); ++i) {
            const double ratio = matches_[i].residual / width;
            weights[i] = matches_[i].is_valid ? 1 / ((1 + ratio * ratio) * (1 + ratio * ratio)) : 0;
        }
        move(weights, SurfaceApproach::kDamping, false);
    }
}

double SurfaceFit::wide_cost() const {
    double cost = 0;
    for (const SurfaceMatch& match : matches_) {
        const double ratio = match.residual / SurfaceApproach::kLastWidth;
        cost += match.is_valid ? ratio * ratio / (1 + ratio * ratio) : 1;
    }
    return cost / static_cast<double>(matches_.size());
}

double SurfaceFit::robust_scale() const {
    std::vector<double> ratios;
    ratios.reserve(matches_.size());
    for (const SurfaceMatch& match : matches_)
        if (match.is_valid) ratios.push_back(std::abs(match.residual) / match.expected);
    return std::max(SurfaceKernel::kMedianToSigma * median(std::move(ratios)),
                    SurfaceKernel::kMinScale);
}

std::vector<double> SurfaceFit::weights(double scale) const {
    std::vector<double> made(matches_.size());
    for (size_t i = 0; i < made.size(); ++i)
        made[i] = matches_[i].is_valid
                      ? tukey_weight(matches_[i].residual / (matches_[i].expected * scale))
                      : 0;
    return made;
}

void SurfaceFit::refine() {
    for (int round = 0; round < SurfaceKernel::kMaxRounds; ++round)
        if (move(weights(robust_scale()), SurfaceKernel::kDamping, true) < SurfaceKernel::kRest)
            break;
}

SurfaceFitQuality SurfaceFit::quality(double scale) const {
    SurfaceFitQuality quality;
    quality.scale = robust_scale();
    if (scale == 0) scale = quality.scale;
    std::vector<double> lengths;
    double squared = 0, inliers = 0;
    for (const SurfaceMatch& match : matches_) {
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
    const auto count = static_cast<double>(matches_.size());
    quality.robust_mm = SurfaceKernel::kMedianToSigma * median(std::move(lengths));
    quality.rms_mm = inliers > 0 ? std::sqrt(squared / inliers) : 0;
    quality.inlier_share = inliers / count;
    quality.cost /= count;
    return quality;
}

PoseInformation SurfaceFit::information(double scale, double& whole) const {
    PoseInformation made;
    made.centre = problem_->centre;
    made.length = problem_->length;
    whole = 0;
    // An M-estimator's covariance (Huber, Robust Statistics, 1981, 7.6): psi^2 and psi' stand in
    // for the residuals' squares and for 1.
    double psi_squared = 0, slope = 0, used = 0;
    for (const SurfaceMatch& match : matches_) {
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
    const double freedom = used - static_cast<double>(made.matrix.rows());
    if (freedom <= 0 || slope <= 0) return made;
    made.variance_scale =
        scale * scale * (psi_squared / freedom) / ((slope / used) * (slope / used));
    return made;
}

}  // namespace defrec
