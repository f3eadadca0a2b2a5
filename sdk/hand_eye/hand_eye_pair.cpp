// See hand_eye_pair.hpp.
#include "sdk/hand_eye/hand_eye_pair.hpp"

#include <Eigen/Cholesky>

#include "sdk/hand_eye/cross_matrix.hpp"
#include "sdk/hand_eye/pose_stream.hpp"

namespace defrec {

HandEyeResidual hand_eye_residual(const HandEyePair& pair, const HandEyeTransforms& transforms) {
    const Eigen::Isometry3d error = pair.camera.inverse() *
                                    transforms.tracker_from_world.inverse() * pair.tracker *
                                    transforms.marker_from_camera;
    HandEyeResidual residual;
    residual << turn_of(error.linear()), error.translation();
    return residual;
}

HandEyeMatrix hand_eye_whitening(const HandEyeNoise& noise, const HandEyeTransforms& transforms) {
    const Eigen::Isometry3d& x = transforms.marker_from_camera;
    const Eigen::Matrix3d lever = cross_matrix(x.linear().transpose() * x.translation()),
                          one = Eigen::Matrix3d::Identity();
    const double turn = noise.tracker_rad * noise.tracker_rad,
                 place = noise.tracker_mm * noise.tracker_mm;
    HandEyeMatrix covariance;
    covariance.topLeftCorner<3, 3>() = (turn + noise.camera_rad * noise.camera_rad) * one;
    covariance.bottomLeftCorner<3, 3>() = -turn * lever;
    covariance.topRightCorner<3, 3>() = turn * lever;
    covariance.bottomRightCorner<3, 3>() =
        (place + noise.camera_mm * noise.camera_mm) * one - turn * lever * lever;
    const Eigen::LLT<HandEyeMatrix> factor(covariance);
    return factor.matrixL().solve(HandEyeMatrix(HandEyeMatrix::Identity()));
}

}  // namespace defrec
