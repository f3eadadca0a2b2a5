// See surface_registration.hpp. Every start approaches with a few of the points; the best of those
// that end at different poses are refined with all. The covariance is the inverse of the normal
// equations at the minimum, which is the leading part of Censi's closed form for ICP (An accurate
// closed-form estimate of ICP's covariance, ICRA 2007), scaled by the residuals and by how many
// neighbours share an error.
#include "sdk/registration/surface_registration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "sdk/base/os/helped_loop.hpp"
#include "sdk/registration/decisions.hpp"
#include "sdk/registration/starts.hpp"
#include "sdk/registration/surface_fit.hpp"
#include "sdk/registration/surface_verdict.hpp"

namespace defrec {
namespace {

using decisions::RegistrationVerdicts;
using decisions::SurfaceSearch;

class Search {
  public:
    Search(const ModelSurface& model, const SeenSurface& seen, const SurfaceOptions& options,
           const Services* helpers)
        : options_(options), helpers_(helpers), problem_(model, seen, options) {}

    Registration run() {
        std::vector<SurfaceFit> fits =
            refined(approached(), problem_.step_for(SurfaceSearch::kRefinePoints));
        rank(fits);
        fits = refined(worth_refining(fits), problem_.step_for(SurfaceSearch::kMaxPoints));
        rank(fits);
        return conclude(fits);
    }

  private:
    // Where the starts end, the best first, each pose once.
    std::vector<Pose> approached() const {
        const std::vector<Pose> starts =
            spread_starts(options_.start, problem_.centre, options_.start_turn,
                          options_.start_shift_mm, options_.starts);
        std::vector<Pose> ends(starts.size());
        std::vector<double> cost(starts.size());
        const size_t step = problem_.step_for(SurfaceSearch::kApproachPoints);
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
        const double scale = fits.front().matches().quality().scale;
        const double most =
            SurfaceSearch::kWorthRefining * fits.front().matches().quality(scale).cost;
        std::vector<Pose> poses;
        for (const SurfaceFit& fit : fits)
            if (poses.empty() || fit.matches().quality(scale).cost <= most)
                poses.push_back(fit.pose());
        return poses;
    }

    // The best first, all judged by one scale.
    static void rank(std::vector<SurfaceFit>& fits) {
        double scale = std::numeric_limits<double>::infinity();
        for (const SurfaceFit& fit : fits) scale = std::min(scale, fit.matches().quality().scale);
        std::stable_sort(fits.begin(), fits.end(), [&](const SurfaceFit& a, const SurfaceFit& b) {
            return a.matches().quality(scale).cost < b.matches().quality(scale).cost;
        });
    }

    // Root mean square by which the points move from one pose of the model to another.
    double distance(const Pose& a, const Pose& b) const {
        const Pose to_model = a.inverse();
        const size_t step = problem_.step_for(SurfaceSearch::kDistancePoints);
        double squared = 0, count = 0;
        for (size_t i = 0; i < problem_.points.size(); i += step, ++count) {
            const Eigen::Vector3d& place = problem_.points[i].place;
            squared += (b * (to_model * place) - place).squaredNorm();
        }
        return std::sqrt(squared / count);
    }

    Registration conclude(const std::vector<SurfaceFit>& fits) const {
        const SurfaceMatches& matches = fits.front().matches();
        const double scale = matches.quality().scale;
        Registration result;
        result.pose = fits.front().pose();
        double whole = 0;
        PoseInformation information = matches.information(scale, Twist::RowsAtCompileTime, whole);
        const double correlated = residual_correlation(matches, scale);
        // As far as the model's error shows, the residuals hold it already.
        information.variance_scale =
            std::max(information.variance_scale * correlated, model_share(matches));
        const PoseUncertainty uncertainty = uncertainty_of(
            information, whole, least_open_share(problem_.model), options_.max_error_mm);
        result.covariance = uncertainty.covariance;
        result.free = uncertainty.free;
        SurfaceMatches all(problem_, 1);
        all.find(problem_.model.tree(), result.pose);
        tell_residuals(matches, all, correlated, options_, result);
        add_alternatives(result, fits);
        judge(options_, uncertainty.worst_mm, result);
        return result;
    }

    void add_alternatives(Registration& result, const std::vector<SurfaceFit>& fits) const {
        const double scale = result.residuals.error_ratio;
        const double cost = fits.front().matches().quality(scale).cost;
        // Costs of poses that fit alike differ by chance: a unit of chi^2 is Tukey's c^2 / 6.
        const double c = decisions::SurfaceKernel::kTukey;
        const double chance = RegistrationVerdicts::kChiSquared * result.residuals.correlated * 3 /
                              (c * c * static_cast<double>(result.residuals.used));
        const double limit = std::max(cost * RegistrationVerdicts::kLikeCost, cost + chance);
        std::vector<Pose> told{result.pose};
        for (size_t i = 1; i < fits.size(); ++i) {
            const SurfaceFitQuality quality = fits[i].matches().quality(scale);
            const bool is_new = std::none_of(told.begin(), told.end(), [&](const Pose& pose) {
                return distance(pose, fits[i].pose()) < RegistrationVerdicts::kOtherPose;
            });
            if (!is_new || quality.cost > limit) continue;
            told.push_back(fits[i].pose());
            result.alternatives.push_back({fits[i].pose(), distance(result.pose, fits[i].pose()),
                                           quality.rms_mm, quality.inlier_share});
        }
    }

    const SurfaceOptions& options_;
    const Services* helpers_;
    SurfaceProblem problem_;
};

}  // namespace

Registration register_surface(const ModelSurface& model, const SeenSurface& seen,
                              const SurfaceOptions& options, const Services* helpers) {
    return Search(model, seen, options, helpers).run();
}

}  // namespace defrec
