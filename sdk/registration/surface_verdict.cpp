// See surface_verdict.hpp.
#include "sdk/registration/surface_verdict.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "sdk/base/util/error.hpp"
#include "sdk/registration/decisions.hpp"
#include "sdk/registration/residual_correlation.hpp"

namespace defrec {
namespace {

using decisions::RegistrationVerdicts;
using decisions::SurfaceKernel;
using decisions::SurfaceSearch;

float shown(double value) { return static_cast<float>(std::round(100 * value) / 100); }
float percent(double share) { return static_cast<float>(std::round(100 * share)); }

// Points within kInlier times the scale that still would be good enough.
bool is_inlier(const SurfaceMatch& match, double scale, double max_residual_mm) {
    const double sigma = std::min(match.expected * scale, max_residual_mm);
    return match.is_valid && std::abs(match.residual) <= SurfaceKernel::kInlier * sigma;
}

}  // namespace

double model_share(const SurfaceMatches& matches) {
    const SurfaceProblem& problem = *matches.problem;
    const double area = 2 * std::numbers::pi * problem.length * problem.length;
    const double parts =
        std::max(1.0, area / (SurfaceSearch::kModelErrorLength * SurfaceSearch::kModelErrorLength));
    double squared = 0, count = 0;
    for (const SurfaceMatch& match : matches.all) {
        if (!match.is_valid) continue;
        squared += match.expected * match.expected;
        ++count;
    }
    if (count == 0) return 0;
    const double error = problem.model_error_mm;
    return error * error * count / (squared / count * parts);
}

double residual_correlation(const SurfaceMatches& matches, double scale) {
    std::vector<Eigen::Vector3d> places;
    std::vector<double> values;
    for (const SurfaceMatch& match : matches.all) {
        const double value = match.residual / (match.expected * scale);
        if (!match.is_valid || std::abs(value) > SurfaceKernel::kInlier) continue;
        places.push_back(match.place);
        values.push_back(value);
    }
    return design_effect(places, values);
}

double least_open_share(const ModelSurface& model) {
    const double angle =
        std::max(model.findings().facet_angle * decisions::FreeMotions::kFacetShare,
                 decisions::FreeMotions::kMinAngle);
    return angle * angle;
}

void tell_residuals(const SurfaceMatches& matches, const SurfaceMatches& all, double correlated,
                    const SurfaceOptions& options, Registration& result) {
    const SurfaceFitQuality quality = matches.quality();
    double inliers = 0;
    for (const SurfaceMatch& match : matches.all)
        inliers += is_inlier(match, quality.scale, options.max_residual_mm);
    result.residuals = {quality.rms_mm, quality.robust_mm,
                        quality.scale,  inliers / static_cast<double>(matches.all.size()),
                        correlated,     matches.all.size()};
    result.residual_mm.clear();
    result.is_inlier.clear();
    for (const SurfaceMatch& match : all.all) {
        result.residual_mm.push_back(match.is_valid ? static_cast<float>(match.residual)
                                                    : std::numeric_limits<float>::quiet_NaN());
        result.is_inlier.push_back(is_inlier(match, quality.scale, options.max_residual_mm));
    }
}

void judge(const SurfaceOptions& options, double worst_mm, Registration& result) {
    const RegistrationResiduals& residuals = result.residuals;
    result.verdict = RegistrationVerdict::kFailed;
    if (residuals.robust_mm > options.max_residual_mm) {
        result.reason = concat("no pose fits: the points are off by ", shown(residuals.robust_mm),
                               " mm, expected ", shown(options.max_residual_mm), " at most");
    } else if (residuals.inlier_share < options.min_inlier_share) {
        result.reason = concat("no pose fits: ", percent(residuals.inlier_share),
                               " % of the points lie on the model, expected ",
                               percent(options.min_inlier_share), " at least");
    } else if (residuals.error_ratio > RegistrationVerdicts::kMaxRatio) {
        result.reason =
            concat("no pose fits: the points are off by ", shown(residuals.robust_mm), " mm, ",
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

}  // namespace defrec
