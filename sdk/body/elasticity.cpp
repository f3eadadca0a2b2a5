// See elasticity.hpp.
#include "sdk/body/elasticity.hpp"

#include <cmath>

namespace defrec {
namespace {

using StrainMatrix = Eigen::Matrix<double, 6, 24>;  // xx, yy, zz, 2 xy, 2 yz, 2 zx

// Strains for displacements of the corners, at a place in the unit cube.
StrainMatrix strains_at(const Eigen::Vector3d& place) {
    StrainMatrix strains = StrainMatrix::Zero();
    for (int corner = 0; corner < 8; ++corner) {
        double value[3], slope[3];
        for (int axis = 0; axis < 3; ++axis) {
            const bool is_high = (corner >> axis & 1) != 0;
            value[axis] = is_high ? place[axis] : 1 - place[axis];
            slope[axis] = is_high ? 1 : -1;
        }
        const double dx = slope[0] * value[1] * value[2], dy = value[0] * slope[1] * value[2],
                     dz = value[0] * value[1] * slope[2];
        const int column = 3 * corner;
        strains(0, column) = strains(3, column + 1) = strains(5, column + 2) = dx;
        strains(1, column + 1) = strains(3, column) = strains(4, column + 2) = dy;
        strains(2, column + 2) = strains(4, column + 1) = strains(5, column) = dz;
    }
    return strains;
}

}  // namespace

CubeStiffness cube_stiffness(double poisson_ratio) {
    const double shear = 0.5 / (1 + poisson_ratio),
                 lame = poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
    Eigen::Matrix<double, 6, 1> of_strains;
    of_strains << 2 * shear, 2 * shear, 2 * shear, shear, shear, shear;
    CubeStiffness stiffness = CubeStiffness::Zero();
    const double offset = 0.5 / std::sqrt(3.0);  // of the two Gauss points from the middle
    for (int point = 0; point < 8; ++point) {
        const Eigen::Vector3d place(0.5 + (point & 1 ? offset : -offset),
                                    0.5 + (point & 2 ? offset : -offset),
                                    0.5 + (point & 4 ? offset : -offset));
        const StrainMatrix strains = strains_at(place);
        stiffness += strains.transpose() * of_strains.asDiagonal() * strains / 8;
    }
    const Eigen::Matrix<double, 1, 24> volume =
        strains_at(Eigen::Vector3d::Constant(0.5)).topRows<3>().colwise().sum();
    stiffness += lame * volume.transpose() * volume;
    return stiffness;
}

}  // namespace defrec
