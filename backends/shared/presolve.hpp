// The rigid motion that brings deformed landmarks onto their matches, found before stage lm
// iterates (docs/stages/lm.md).
#pragma once
#include <Eigen/Dense>

#include "backends/shared/lm_inputs.hpp"
#include "backends/shared/lm_terms.hpp"

namespace defrec {

// The weighted least-squares rigid motion from -> to (Kabsch 1976, with Umeyama's determinant
// guard). Where the points do not fix a rotation it is a translation.
class RigidFit {
  public:
    void add(double weight, Vec3<double> from, Vec3<double> to) {
        const Eigen::Vector3d a(from.x, from.y, from.z), b(to.x, to.y, to.z);
        weight_ += weight;
        from_ += weight * a;
        to_ += weight * b;
        moment_ += weight * b * a.transpose();
    }
    DualQuaternion<double> solve() const {
        if (!(weight_ > 0)) return DualQuaternion<double>::identity();
        const Eigen::Vector3d a = from_ / weight_, b = to_ / weight_;
        const Eigen::Matrix3d moment = moment_ / weight_ - b * a.transpose();
        const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moment,
                                                    Eigen::ComputeFullU | Eigen::ComputeFullV);
        Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
        if (svd.singularValues()(1) > kMinSpreadMm2) {
            const double sign = (svd.matrixU() * svd.matrixV()).determinant() < 0 ? -1 : 1;
            rotation = svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() *
                       svd.matrixV().transpose();
        }
        const Eigen::Vector3d t = b - rotation * a;
        const double m[9] = {rotation(0, 0), rotation(0, 1), rotation(0, 2),
                             rotation(1, 0), rotation(1, 1), rotation(1, 2),
                             rotation(2, 0), rotation(2, 1), rotation(2, 2)};
        return from_rigid(m, t.data());
    }

  private:
    static constexpr double kMinSpreadMm2 = 1e-2;
    double weight_ = 0;
    Eigen::Vector3d from_ = Eigen::Vector3d::Zero(), to_ = Eigen::Vector3d::Zero();
    Eigen::Matrix3d moment_ = Eigen::Matrix3d::Zero();
};

constexpr int kPresolveRounds = 5, kPresolveMinMatches = 6;

// deformed: where each landmark with a preselected match is by the present motions; only those
// count. The identity where they are too few, or where no rigid motion brings them closer by
// Tukey's measure.
inline DualQuaternion<double> presolve(const defrec_match* matches,
                                       std::span<const Vec3<double>> deformed, double tukey_mm) {
    const auto identity = DualQuaternion<double>::identity();
    int32_t count = 0;
    for (size_t i = 0; i < deformed.size(); ++i) count += preselected(matches[i]) ? 1 : 0;
    if (count < kPresolveMinMatches) return identity;

    const auto squared_error = [&](const DualQuaternion<double>& motion, size_t i) {
        const Vec3<double> error = apply(motion, deformed[i]) - load3<double>(matches[i].position);
        return dot(error, error);
    };
    const auto cost = [&](const DualQuaternion<double>& motion) {
        double sum = 0;
        for (size_t i = 0; i < deformed.size(); ++i)
            if (preselected(matches[i]))
                sum += double(matches[i].weight) *
                       tukey(squared_error(motion, i), 1 / (tukey_mm * tukey_mm)).cost;
        return sum;
    };
    DualQuaternion<double> motion = identity;
    for (int round = 0; round < kPresolveRounds; ++round) {
        double weights = 0, squares = 0;
        for (size_t i = 0; i < deformed.size(); ++i)
            if (preselected(matches[i])) {
                weights += double(matches[i].weight);
                squares += double(matches[i].weight) * squared_error(motion, i);
            }
        const double c2 = std::max(tukey_mm * tukey_mm, 9 * squares / weights);
        RigidFit fit;
        for (size_t i = 0; i < deformed.size(); ++i)
            if (preselected(matches[i]))
                fit.add(double(matches[i].weight) * tukey(squared_error(motion, i), 1 / c2).weight,
                        deformed[i], load3<double>(matches[i].position));
        motion = fit.solve();
    }
    return cost(motion) < cost(identity) ? motion : identity;
}

}  // namespace defrec
