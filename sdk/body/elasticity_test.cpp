// The stiffness of a cube: rigid motions, uniform strains, energy, and a bar that bends.
#include "sdk/body/elasticity.hpp"

#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>
#include <cmath>

using defrec::cube_stiffness;
using defrec::CubeStiffness;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr std::array<double, 4> kRatios{0.0, 0.3, 0.43, 0.49};

using Corners = Eigen::Matrix<double, 24, 1>;

Vector3d corner_place(int corner) { return Vector3d(corner & 1, corner >> 1 & 1, corner >> 2 & 1); }

// Displacements of the corners, x -> gradient x.
Corners linear_field(const Matrix3d& gradient) {
    Corners field;
    for (int corner = 0; corner < 8; ++corner)
        field.segment<3>(3 * corner) = gradient * corner_place(corner);
    return field;
}

// Forces at the corners that a uniform stress in the unit cube needs: its traction on three faces
// each, a quarter of a face to a corner.
Corners forces_of(const Matrix3d& stress) {
    Corners forces;
    for (int corner = 0; corner < 8; ++corner)
        forces.segment<3>(3 * corner) = stress * (2 * corner_place(corner) - Vector3d::Ones()) / 4;
    return forces;
}

// Hooke's law, Young's modulus 1.
Matrix3d stress_of(const Matrix3d& gradient, double ratio) {
    const Matrix3d strain = (gradient + gradient.transpose()) / 2;
    return (strain + ratio / (1 - 2 * ratio) * strain.trace() * Matrix3d::Identity()) / (1 + ratio);
}

// Bends a bar of count cubes along x and one square of `across` cubes, one end held and the other
// pulled along z by a force of 1; gives the mean deflection of the end.
double deflection(int count, int across, double ratio) {
    const int side = across + 1, nodes = (count + 1) * side * side;
    const auto node = [&](int x, int y, int z) { return (x * side + y) * side + z; };
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(3 * nodes, 3 * nodes);
    const CubeStiffness cube = cube_stiffness(ratio);
    for (int x = 0; x < count; ++x)
        for (int y = 0; y < across; ++y)
            for (int z = 0; z < across; ++z)
                for (int a = 0; a < 8; ++a)
                    for (int b = 0; b < 8; ++b) {
                        const int row = node(x + (a & 1), y + (a >> 1 & 1), z + (a >> 2)),
                                  column = node(x + (b & 1), y + (b >> 1 & 1), z + (b >> 2));
                        sum.block<3, 3>(3 * row, 3 * column) += cube.block<3, 3>(3 * a, 3 * b);
                    }
    const int held = 3 * side * side, free = 3 * nodes - held;
    Eigen::VectorXd force = Eigen::VectorXd::Zero(free);
    for (int i = 0; i < side * side; ++i) force[free - 1 - 3 * i] = 1.0 / (side * side);
    const Eigen::VectorXd moved = sum.bottomRightCorner(free, free).llt().solve(force);
    return moved.dot(force);
}

}  // namespace

TEST_CASE("a cube's stiffness is symmetric, and rigid motions need no force, all else does") {
    for (const double ratio : kRatios) {
        CAPTURE(ratio);
        const CubeStiffness cube = cube_stiffness(ratio);
        CHECK((cube - cube.transpose()).norm() < 1e-12 * cube.norm());
        const Eigen::SelfAdjointEigenSolver<CubeStiffness> solver(cube);
        CHECK(solver.eigenvalues().head<6>().cwiseAbs().maxCoeff() < 1e-12);
        CHECK(solver.eigenvalues()[6] > 0.01);
        for (int axis = 0; axis < 3; ++axis) {
            Corners shift = Corners::Zero();
            for (int corner = 0; corner < 8; ++corner) shift[3 * corner + axis] = 1;
            CHECK((cube * shift).norm() < 1e-12);
            Matrix3d turn = Matrix3d::Zero();
            turn((axis + 1) % 3, (axis + 2) % 3) = 1;
            turn((axis + 2) % 3, (axis + 1) % 3) = -1;
            CHECK((cube * linear_field(turn)).norm() < 1e-12);
        }
    }
}

TEST_CASE("a cube under a uniform strain has the forces of Hooke's law") {
    for (const double ratio : kRatios) {
        CAPTURE(ratio);
        const CubeStiffness cube = cube_stiffness(ratio);
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column) {
                CAPTURE(row);
                CAPTURE(column);
                Matrix3d gradient = Matrix3d::Zero();
                gradient(row, column) = 0.01;
                const Corners wanted = forces_of(stress_of(gradient, ratio));
                CHECK((cube * linear_field(gradient) - wanted).norm() <
                      1e-12 + 1e-10 * wanted.norm());
            }
        // A bar that is drawn out along y and becomes thinner.
        const Matrix3d drawn = Vector3d(-ratio, 1, -ratio).asDiagonal();
        const Corners forces = cube * linear_field(drawn);
        for (int corner = 0; corner < 8; ++corner)
            CHECK((forces.segment<3>(3 * corner) - Vector3d(0, corner >> 1 & 1 ? 0.25 : -0.25, 0))
                      .norm() < 1e-12);
    }
}

TEST_CASE("a cube that bends has the energy of its shape functions, whatever its volume does") {
    for (const double ratio : kRatios) {
        CAPTURE(ratio);
        for (int axis = 0; axis < 3; ++axis) {
            Corners bent = Corners::Zero();
            for (int corner = 0; corner < 8; ++corner) {
                const Vector3d at = corner_place(corner) - Vector3d::Constant(0.5);
                bent[3 * corner + axis] = at[axis] * at[(axis + 1) % 3];
            }
            // A strain and a shear, whose squares have the mean 1/12.
            const double shear = 0.5 / (1 + ratio);
            CHECK(std::abs(bent.dot(cube_stiffness(ratio) * bent) - 3 * shear / 12) < 1e-12);
        }
    }
}

TEST_CASE("a bar of nearly incompressible cubes bends as beam theory has it") {
    // Euler's and Timoshenko's deflection under a force at the end, Young's modulus 1.
    constexpr int kLength = 12, kAcross = 2;
    constexpr double kInertia = kAcross * kAcross * kAcross * kAcross / 12.0;
    for (const double ratio : {0.3, 0.43, 0.49}) {
        CAPTURE(ratio);
        const double bent = kLength * kLength * kLength / (3 * kInertia),
                     sheared = kLength * 2 * (1 + ratio) / (5.0 / 6 * kAcross * kAcross);
        const double found = deflection(kLength, kAcross, ratio);
        CHECK(found > 0.8 * (bent + sheared));
        CHECK(found < 1.1 * (bent + sheared));
    }
    CHECK(deflection(kLength, kAcross, 0.49) > 0.9 * deflection(kLength, kAcross, 0.3));
}
