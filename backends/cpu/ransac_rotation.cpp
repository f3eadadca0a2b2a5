// The rotation nearest to a 3x3 correlation, as the eigenvector of Horn's (1987) symmetric 4x4
// matrix; its largest eigenvalue by Newton's method on the characteristic polynomial (Theobald
// 2005).
#include <Eigen/Dense>
#include <cmath>

#include "backends/cpu/ransac_kernels.hpp"
#include "backends/shared/rigid_fit.hpp"

namespace defrec::cpu {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector4d;

// m = sum to from^T, normalised.
Matrix4d horn_matrix(const Matrix3d& m) {
    Matrix4d k;
    k << m(0, 0) + m(1, 1) + m(2, 2), m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1),  //
        m(2, 1) - m(1, 2), m(0, 0) - m(1, 1) - m(2, 2), m(0, 1) + m(1, 0), m(0, 2) + m(2, 0),   //
        m(0, 2) - m(2, 0), m(0, 1) + m(1, 0), m(1, 1) - m(0, 0) - m(2, 2), m(1, 2) + m(2, 1),   //
        m(1, 0) - m(0, 1), m(0, 2) + m(2, 0), m(1, 2) + m(2, 1), m(2, 2) - m(0, 0) - m(1, 1);
    return k;
}

double cofactor(const Matrix4d& a, int row, int column) {
    const int r[3] = {row == 0, 1 + (row <= 1), 2 + (row <= 2)},
              c[3] = {column == 0, 1 + (column <= 1), 2 + (column <= 2)};
    const double minor =
        a(r[0], c[0]) * (a(r[1], c[1]) * a(r[2], c[2]) - a(r[1], c[2]) * a(r[2], c[1])) -
        a(r[0], c[1]) * (a(r[1], c[0]) * a(r[2], c[2]) - a(r[1], c[2]) * a(r[2], c[0])) +
        a(r[0], c[2]) * (a(r[1], c[0]) * a(r[2], c[1]) - a(r[1], c[1]) * a(r[2], c[0]));
    return (row + column) % 2 == 0 ? minor : -minor;
}

// The eigenvector of a's largest eigenvalue; false where that is a double one, or nearly: points on
// a line. |m| = 1.
bool dominant_eigenvector(const Matrix3d& m, Vector4d& out) {
    const Matrix4d a = horn_matrix(m);
    const double c2 = -2.0 * m.squaredNorm(), c1 = -8.0 * m.determinant();
    double c0 = 0;
    for (int i = 0; i < 4; ++i) c0 += a(0, i) * cofactor(a, 0, i);
    double value = std::sqrt(3.0);
    for (int i = 0; i < 20; ++i) {
        const double square = value * value;
        const double polynomial = (square + c2) * square + c1 * value + c0,
                     slope = 4.0 * square * value + 2.0 * c2 * value + c1;
        if (!(slope > 1e-6)) break;
        const double step = polynomial / slope;
        value -= step;
        if (std::abs(step) < 1e-12) break;
    }
    const Matrix4d shifted = a - value * Matrix4d::Identity();
    int largest = 0;
    double diagonal[4];
    for (int i = 0; i < 4; ++i) {
        diagonal[i] = std::abs(cofactor(shifted, i, i));
        if (diagonal[i] > diagonal[largest]) largest = i;
    }
    if (diagonal[largest] < 1e-6) return false;
    for (int i = 0; i < 4; ++i) out[i] = cofactor(shifted, largest, i);
    out.normalize();
    return true;
}

// Kabsch's (1978) way, slower and never at a loss.
Matrix3d rotation_by_svd(const Matrix3d& m) {
    return rotation_from_svd(
        Eigen::JacobiSVD<Matrix3d>(m, Eigen::ComputeFullU | Eigen::ComputeFullV));
}

}  // namespace

void nearest_rotation(const double m[9], float out[9]) {
    const Matrix3d given = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m);
    const double norm = given.norm();
    Matrix3d rotation = Matrix3d::Identity();
    if (norm > 0 && std::isfinite(norm)) {
        const Matrix3d scaled = given / norm;
        Vector4d q;
        rotation = dominant_eigenvector(scaled, q)
                       ? Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix()
                       : rotation_by_svd(scaled);
    }
    for (int i = 0; i < 9; ++i) out[i] = float(rotation(i / 3, i % 3));
}

}  // namespace defrec::cpu
