// A rigid motion, and a small one after it.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

namespace defrec {

// A turn in rad about x, y, z, then a shift in mm along them.
using Twist = Eigen::Matrix<double, 6, 1>;
using TwistMatrix = Eigen::Matrix<double, 6, 6>;

// x_to = rotation * x_from + translation, mm.
struct Pose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();

    Eigen::Vector3d operator*(const Eigen::Vector3d& place) const {
        return rotation * place + translation;
    }
    Pose inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
};

// values: xx, xy, xz, yy, yz, zz; symmetric_values() gives them back.
template <class Real>
Eigen::Matrix3d symmetric_matrix(const Real* values) {
    Eigen::Matrix3d made;
    made << values[0], values[1], values[2],  //
        values[1], values[3], values[4],      //
        values[2], values[4], values[5];
    return made;
}

inline std::array<double, 6> symmetric_values(const Eigen::Matrix3d& matrix) {
    return {matrix(0, 0), matrix(0, 1), matrix(0, 2), matrix(1, 1), matrix(1, 2), matrix(2, 2)};
}

inline Eigen::Matrix3d rotation_of(const Eigen::Vector3d& turn) {
    const double angle = turn.norm();
    if (angle == 0) return Eigen::Matrix3d::Identity();
    return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

// The pose, and then a turn about a centre and a shift.
inline Pose moved(const Pose& pose, const Twist& twist, const Eigen::Vector3d& centre) {
    const Eigen::Matrix3d turn = rotation_of(twist.head<3>());
    Pose after{turn * pose.rotation, turn * (pose.translation - centre) + centre + twist.tail<3>()};
    // Rounding adds up over many small motions.
    after.rotation = Eigen::Quaterniond(after.rotation).normalized().toRotationMatrix();
    return after;
}

// How far a place moves with a twist about the origin: place_shift(x) * twist, mm.
inline Eigen::Matrix<double, 3, 6> place_shift(const Eigen::Vector3d& place) {
    Eigen::Matrix<double, 3, 6> shift;
    shift << 0, place.z(), -place.y(), 1, 0, 0,  //
        -place.z(), 0, place.x(), 0, 1, 0,       //
        place.y(), -place.x(), 0, 0, 0, 1;
    return shift;
}

}  // namespace defrec
