// Rigid motions.
#include "sdk/evaluation/score/rigid_fit.hpp"

namespace defrec::cli {

Pose inverse(const Pose& pose) { return {pose.rotation.t(), -(pose.rotation.t() * pose.position)}; }

Pose operator*(const Pose& a, const Pose& b) {
    return {a.rotation * b.rotation, a.rotation * b.position + a.position};
}

Pose rigid_fit(const std::vector<cv::Vec3d>& from, const std::vector<cv::Vec3d>& to,
               const std::vector<double>& weights) {
    cv::Vec3d from_centre(0, 0, 0), to_centre(0, 0, 0);
    double sum = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
        from_centre += weights[i] * from[i];
        to_centre += weights[i] * to[i];
        sum += weights[i];
    }
    from_centre /= sum;
    to_centre /= sum;
    cv::Matx33d moments = cv::Matx33d::zeros();
    for (std::size_t i = 0; i < from.size(); ++i)
        moments += weights[i] * ((to[i] - to_centre) * (from[i] - from_centre).t());
    cv::Matx33d u, vt;
    cv::Matx31d singular;
    cv::SVD::compute(moments, singular, u, vt);
    const double sign = cv::determinant(u) * cv::determinant(vt) < 0 ? -1 : 1;
    const cv::Matx33d rotation = u * cv::Matx33d(1, 0, 0, 0, 1, 0, 0, 0, sign) * vt;
    return {rotation, to_centre - rotation * from_centre};
}

}  // namespace defrec::cli
