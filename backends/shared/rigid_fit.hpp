// The rigid motion that fits pairs of points best.
#pragma once
#include <Eigen/Dense>

#include "backends/shared/motion.hpp"

namespace defrec {

// The rotation R that maximises trace(R^T m), never a reflection (Kabsch 1978, Umeyama 1991), from
// the decomposition of m.
inline Eigen::Matrix3d rotation_from_svd(const Eigen::JacobiSVD<Eigen::Matrix3d>& svd) {
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    return svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

// The weighted least-squares rigid motion from -> to. Where the points do not fix a rotation it is
// a translation.
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
        if (svd.singularValues()(1) > kMinSpreadMm2) rotation = rotation_from_svd(svd);
        const Eigen::Vector3d t = b - rotation * a;
        const double m[9] = {rotation(0, 0), rotation(0, 1), rotation(0, 2),
                             rotation(1, 0), rotation(1, 1), rotation(1, 2),
                             rotation(2, 0), rotation(2, 1), rotation(2, 2)};
        return from_rigid(m, t.data());
    }

  private:
    double weight_ = 0;
    Eigen::Vector3d from_ = Eigen::Vector3d::Zero(), to_ = Eigen::Vector3d::Zero();
    Eigen::Matrix3d moment_ = Eigen::Matrix3d::Zero();
};

}  // namespace defrec
