// For tests: deformations of an organ that do not come from the library's elastic model.
#pragma once
#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "sdk/registration/test_organ.hpp"

namespace defrec {

enum class TestDeformation {
    kNone,
    kBent,       // along a circle, the middle line as long as before
    kTwisted,    // about the long axis, in proportion to the way along it
    kBreathing,  // two transverse waves of 200 to 300 mm, which leave volumes as they are
    kPushed,     // by two forces in an elastic space, compressible or not
};

inline const char* name_of(TestDeformation kind) {
    constexpr const char* kNames[] = {"none", "bent", "twisted", "breathing", "pushed"};
    return kNames[static_cast<int>(kind)];
}

using Displaced = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

// A regularised point force in an infinite elastic space (Kelvin's solution; de Goes and James,
// Regularized Kelvinlets, ACM Trans. Graphics 36, 2017), about 1 where it acts.
struct TestForce {
    Eigen::Vector3d place, force;
    double width, poisson_ratio;

    Eigen::Vector3d operator()(const Eigen::Vector3d& at) const {
        const Eigen::Vector3d from = at - place;
        const double b = 1 / (4 * (1 - poisson_ratio));
        const double distance = std::sqrt(from.squaredNorm() + width * width);
        const double r = distance / width;
        return ((1 - b) / r + 0.5 / (r * r * r)) * force +
               b / (r * r * r) * from * from.dot(force) / (width * width);
    }
};

// With an amount that is in proportion to displacements as long as they are small.
template <class Random>
std::function<Displaced(double)> random_deformation(TestDeformation kind, Random& random) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    const double sign = uniform(random) < 0 ? -1 : 1;
    if (kind == TestDeformation::kBent) {
        const double angle = 3.14 * uniform(random);
        const Eigen::Vector3d side(0, std::cos(angle), std::sin(angle));
        const double middle = 25 * uniform(random);
        return [=](double amount) -> Displaced {
            return [=](const Eigen::Vector3d& at) -> Eigen::Vector3d {
                const double curvature = sign * amount * 1e-3, along = at.x() - middle,
                             across = side.dot(at), turn = curvature * along,
                             radius = 1 / curvature - across;
                return at + (radius * std::sin(turn) - along) * Eigen::Vector3d::UnitX() +
                       (1 / curvature - radius * std::cos(turn) - across) * side;
            };
        };
    }
    if (kind == TestDeformation::kTwisted)
        return [=](double amount) -> Displaced {
            return [=](const Eigen::Vector3d& at) -> Eigen::Vector3d {
                return rotation_of({sign * amount * 1e-3 * at.x(), 0, 0}) * at;
            };
        };
    if (kind == TestDeformation::kBreathing) {
        const Eigen::Vector3d one = 0.03 * random_direction(random),
                              other = 0.022 * random_direction(random),
                              along = one.cross(random_direction(random)).normalized(),
                              across = other.cross(random_direction(random)).normalized();
        const double phase = 3 * uniform(random);
        return [=](double amount) -> Displaced {
            return [=](const Eigen::Vector3d& at) -> Eigen::Vector3d {
                return at + amount * (std::sin(one.dot(at) + phase) * along +
                                      std::sin(other.dot(at) + 2 * phase) * across);
            };
        };
    }
    std::vector<TestForce> forces;
    for (int i = 0; i < 2; ++i) {
        const Eigen::Vector3d towards = random_direction(random);
        forces.push_back({organ_shape(towards),
                          random_direction(random) * (1 + uniform(random) / 2),
                          35 + 15 * uniform(random), 0.4 + 0.09 * uniform(random)});
    }
    return [=](double amount) -> Displaced {
        return [=](const Eigen::Vector3d& at) -> Eigen::Vector3d {
            return at + amount * (forces[0](at) + forces[1](at));
        };
    };
}

// The rigid motion that takes places to others, least squares (Arun, Huang and Blostein, IEEE
// Trans. PAMI 9, 1987).
inline Pose rigid_between(const std::vector<Eigen::Vector3d>& from,
                          const std::vector<Eigen::Vector3d>& to) {
    Eigen::Vector3d one = Eigen::Vector3d::Zero(), other = one;
    const auto count = static_cast<double>(from.size());
    for (size_t i = 0; i < from.size(); ++i) {
        one += from[i] / count;
        other += to[i] / count;
    }
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (size_t i = 0; i < from.size(); ++i) sum += (to[i] - other) * (from[i] - one).transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
    if (turn.determinant() < 0) {
        Eigen::Matrix3d left = svd.matrixU();
        left.col(2) *= -1;
        turn = left * svd.matrixV().transpose();
    }
    return {turn, other - turn * one};
}

// One whose vertices are displaced by at most that much, against their best rigid motion.
template <class Random>
Displaced deformation_of(TestDeformation kind, const TestMesh& mesh, double amplitude_mm,
                         Random& random) {
    if (kind == TestDeformation::kNone) return [](const Eigen::Vector3d& at) { return at; };
    const auto family = random_deformation(kind, random);
    std::vector<Eigen::Vector3d> rest;
    for (size_t i = 0; i < mesh.vertices.size() / 3; i += 3) rest.push_back(mesh.vertex(i));
    double amount = 1;
    for (int round = 0;; ++round) {
        const Displaced raw = family(amount);
        std::vector<Eigen::Vector3d> moved;
        for (const Eigen::Vector3d& place : rest) moved.push_back(raw(place));
        const Pose back = rigid_between(moved, rest);
        double most = 0;
        for (size_t i = 0; i < rest.size(); ++i)
            most = std::max(most, (back * moved[i] - rest[i]).norm());
        if (round == 8)
            return [=](const Eigen::Vector3d& at) -> Eigen::Vector3d { return back * raw(at); };
        amount *= amplitude_mm / most;
    }
}

inline TestMesh displaced(const TestMesh& mesh, const Displaced& by) {
    TestMesh made;
    made.triangles = mesh.triangles;
    for (size_t i = 0; i < mesh.vertices.size() / 3; ++i) made.add(by(mesh.vertex(i)));
    return made;
}

}  // namespace defrec
