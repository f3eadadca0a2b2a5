// See rig_trial.hpp.
#include "sdk/doctor/rig_trial.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <utility>

#include "sdk/io/statistics.hpp"

namespace defrec::cli {
namespace {

using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Directions (x, y, 1) of pixels.
std::vector<Eigen::Vector3d> directions_of(const CameraCalibration& camera,
                                           const std::vector<cv::Point2d>& pixels) {
    const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
    std::vector<cv::Point2d> undistorted;
    cv::undistortPoints(pixels, undistorted, matrix, camera.distortion);
    std::vector<Eigen::Vector3d> directions;
    for (const cv::Point2d& p : undistorted) directions.emplace_back(p.x, p.y, 1);
    return directions;
}

// Rotations that turn directions of each view into those of a pair whose baseline lies along x.
struct Rectification {
    explicit Rectification(const StereoCalibration& calibration) {
        const Eigen::Matrix3d rotation = Eigen::Map<const Rotation>(calibration.rotation.data());
        const Eigen::Vector3d translation(calibration.translation.data());
        const Eigen::AngleAxisd turn(rotation);
        const Eigen::Matrix3d half =
            Eigen::AngleAxisd(turn.angle() / 2, turn.axis()).toRotationMatrix();
        const Eigen::Vector3d baseline = half.transpose() * translation;
        const Eigen::Vector3d along(std::copysign(1.0, baseline.x()), 0, 0);
        const Eigen::Matrix3d level =
            Eigen::Quaterniond::FromTwoVectors(baseline, along).toRotationMatrix();
        left = level * half;
        right = level * half.transpose();
        baseline_mm = (level * baseline).x();
    }
    Eigen::Matrix3d left, right;
    double baseline_mm = 0;  // x of the left camera in the right one, below 0 for a right camera
};

}  // namespace

StereoCalibration without(Mistake mistake, const StereoCalibration& calibration) {
    StereoCalibration changed = calibration;
    Eigen::Map<Rotation> rotation(changed.rotation.data());
    Eigen::Map<Eigen::Vector3d> translation(changed.translation.data());
    switch (mistake) {
        case Mistake::kNone:
        case Mistake::kImagesExchanged:
            break;
        case Mistake::kPoseInverted:
            translation = (-(rotation.transpose() * translation)).eval();
            rotation.transposeInPlace();
            break;
        case Mistake::kRotationTurned:
            rotation.transposeInPlace();
            break;
        case Mistake::kTranslationTurned:
            translation = -translation;
            break;
        case Mistake::kCamerasExchanged:
            std::swap(changed.left, changed.right);
            break;
    }
    return changed;
}

bool has_pose(const StereoCalibration& calibration) {
    constexpr double kTolerance = 1e-2;
    const Eigen::Matrix3d rotation = Eigen::Map<const Rotation>(calibration.rotation.data());
    const Eigen::Vector3d translation(calibration.translation.data());
    const auto is_camera = [](const CameraCalibration& camera) {
        return camera.fx > 0 && camera.fy > 0 &&
               std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy);
    };
    return (rotation.transpose() * rotation).isIdentity(kTolerance) && rotation.determinant() > 0 &&
           translation.norm() > 0 && translation.allFinite() && is_camera(calibration.left) &&
           is_camera(calibration.right);
}

RigTrial try_rig(const StereoCalibration& given, std::span<const ViewMatch> matches,
                 Mistake mistake) {
    RigTrial trial;
    trial.mistake = mistake;
    if (matches.empty()) return trial;
    const StereoCalibration calibration = without(mistake, given);
    std::vector<cv::Point2d> left, right;
    for (const ViewMatch& match : matches) {
        const bool is_exchanged = mistake == Mistake::kImagesExchanged;
        left.push_back(is_exchanged ? match.right : match.left);
        right.push_back(is_exchanged ? match.left : match.right);
    }
    const Rectification rectification(calibration);
    const auto left_directions = directions_of(calibration.left, left);
    const auto right_directions = directions_of(calibration.right, right);
    const double focal_length = 0.25 * (calibration.left.fx + calibration.left.fy +
                                        calibration.right.fx + calibration.right.fy);
    std::vector<double> steps, depths;
    for (std::size_t i = 0; i < matches.size(); ++i) {
        const Eigen::Vector3d l = rectification.left * left_directions[i],
                              r = rectification.right * right_directions[i];
        if (!(l.z() > 0) || !(r.z() > 0)) continue;
        const Eigen::Vector2d a = l.head<2>() / l.z(), b = r.head<2>() / r.z();
        const double disparity = a.x() - b.x();
        const double depth = -rectification.baseline_mm / disparity;
        trial.matches.push_back({focal_length * a.x(), focal_length * a.y(),
                                 focal_length * (b.y() - a.y()), focal_length * disparity, depth,
                                 matches[i].pair});
        steps.push_back(std::abs(trial.matches.back().row_step));
        if (depth > 0) depths.push_back(depth);
    }
    trial.row_error_px = nearest_rank(steps, 0.5);
    trial.front_share = static_cast<double>(depths.size()) / static_cast<double>(matches.size());
    trial.depth_mm = nearest_rank(depths, 0.5);
    return trial;
}

}  // namespace defrec::cli
