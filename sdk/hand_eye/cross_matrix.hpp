// The matrix of a cross product.
#pragma once
#include <Eigen/Core>

namespace defrec {

// cross_matrix(a) * b = a x b
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& a) {
    Eigen::Matrix3d matrix;
    matrix << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return matrix;
}

}  // namespace defrec
