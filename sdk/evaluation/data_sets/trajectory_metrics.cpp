// Errors of a camera's trajectory.
#include "sdk/evaluation/data_sets/trajectory_metrics.hpp"

#include <algorithm>
#include <cmath>

namespace defrec::cli {

std::vector<double> absolute_errors(const std::vector<Pose>& truth,
                                    const std::vector<Pose>& predicted) {
    std::vector<double> errors;
    if (truth.empty()) return errors;
    std::vector<cv::Vec3d> from, to;
    for (const Pose& pose : predicted) from.push_back(pose.position);
    for (const Pose& pose : truth) to.push_back(pose.position);
    const Pose fit = rigid_fit(from, to, std::vector<double>(from.size(), 1));
    for (std::size_t i = 0; i < from.size(); ++i)
        errors.push_back(cv::norm(fit.rotation * from[i] + fit.position - to[i]));
    return errors;
}

std::vector<MotionError> relative_errors(const std::vector<Pose>& truth,
                                         const std::vector<Pose>& predicted) {
    std::vector<MotionError> errors;
    for (std::size_t i = 1; i < truth.size(); ++i) {
        const Pose true_motion = inverse(truth[i - 1]) * truth[i];
        const Pose motion = inverse(predicted[i - 1]) * predicted[i];
        const Pose error = inverse(true_motion) * motion;
        const double cosine = (cv::trace(error.rotation) - 1) / 2;
        errors.push_back(
            {cv::norm(error.position), std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / CV_PI});
    }
    return errors;
}

}  // namespace defrec::cli
