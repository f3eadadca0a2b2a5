// See rotation_spread.hpp.
#include "sdk/hand_eye/rotation_spread.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "sdk/hand_eye/pose_stream.hpp"

namespace defrec {

RotationSpread rotation_spread(const HandEyePairs& pairs,
                               const std::vector<std::uint8_t>& is_used) {
    std::vector<Eigen::Matrix3d> rotations;
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (is_used.empty() || is_used[i] != 0) rotations.push_back(pairs[i].tracker.linear());
    RotationSpread spread;
    if (rotations.empty()) return spread;
    // The mean: rotations against the first one, and the turn that is left, until it is none.
    Eigen::Matrix3d mean = rotations.front(), scatter = Eigen::Matrix3d::Zero();
    constexpr int kRounds = 5;
    for (int round = 0; round < kRounds; ++round) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        scatter.setZero();
        for (const Eigen::Matrix3d& rotation : rotations) {
            const Eigen::Vector3d turn = turn_of(mean.transpose() * rotation);
            sum += turn;
            scatter += turn * turn.transpose();
        }
        mean = mean * rotation_of(sum / static_cast<double>(rotations.size()));
    }
    scatter /= static_cast<double>(rotations.size());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
    const Eigen::Vector3d values = solver.eigenvalues().cwiseMax(0);
    spread.turn = std::sqrt(values.sum());
    spread.cross = std::sqrt(values[0] + values[1]);
    spread.axis = solver.eigenvectors().col(2);
    return spread;
}

}  // namespace defrec
