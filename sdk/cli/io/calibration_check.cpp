// What the numbers of a stereo calibration must satisfy, whatever file they came from.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdk/cli/io/calibration.hpp"
#include "sdk/cli/io/exit_code.hpp"
#include "sdk/cli/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr double kMillimetresPerMetre = 1000;
constexpr double kSmallestBaseline = 0.1;    // mm; no stereo camera has less
constexpr double kSuspectBaseline = 0.5;     // below this, "mm" are almost surely metres
constexpr double kLargestBaseline = 1000;    // mm
constexpr double kRotationTolerance = 1e-3;  // on |R^T R - 1|; files round to six digits
constexpr double kRectifiedTolerance = 1e-9;

using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

[[noreturn]] void fail(const std::string& origin, const std::string& message) {
    throw CliError(ExitCode::kCalibration, origin + ": " + message);
}

void check_camera(const CameraCalibration& camera) {
    if (!std::isfinite(camera.fx) || !std::isfinite(camera.fy) || !std::isfinite(camera.cx) ||
        !std::isfinite(camera.cy)) {
        fail(camera.matrix_origin, "the camera matrix holds numbers that are not finite.");
    }
    if (!(camera.fx > 0) || !(camera.fy > 0)) {
        fail(camera.matrix_origin, "fx = " + format_fixed(camera.fx, 3) +
                                       " and fy = " + format_fixed(camera.fy, 3) +
                                       " must both be greater than 0.");
    }
}

// Replaces R by the rotation nearest to it, R = U V^T of its SVD.
void check_rotation(StereoCalibration& calibration) {
    Eigen::Map<Rotation> rotation(calibration.rotation.data());
    const double residual =
        (rotation.transpose() * rotation - Rotation::Identity()).cwiseAbs().maxCoeff();
    const double determinant = rotation.determinant();
    if (!(residual <= kRotationTolerance) || !(determinant > 0)) {
        fail(calibration.rotation_origin,
             "R is not a rotation: |R^T R - 1| reaches " + format_fixed(residual, 6) +
                 " (at most " + format_fixed(kRotationTolerance, 3) + "), its determinant is " +
                 format_fixed(determinant, 6) + ".");
    }
    if (residual == 0) return;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(Eigen::Matrix3d(rotation),
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    rotation = svd.matrixU() * svd.matrixV().transpose();
}

std::string unit_hint(LengthUnit unit, LengthUnit files_unit, double length) {
    if (unit != LengthUnit::kGuarded) return {};
    if (files_unit == LengthUnit::kMillimetre && length < kSuspectBaseline) {
        return " It looks like metres; if it is, pass --units m (if it really is mm, --units mm).";
    }
    if (files_unit == LengthUnit::kMetre && length > kLargestBaseline) {
        return " It looks like millimetres where ROS prescribes metres; if it is, pass --units mm "
               "(if it really is "
               "metres, --units m).";
    }
    return {};
}

void check_baseline(StereoCalibration& calibration, LengthUnit unit, LengthUnit files_unit) {
    const LengthUnit used = unit == LengthUnit::kGuarded ? files_unit : unit;
    std::array<double, 3>& t = calibration.translation;
    if (used == LengthUnit::kMetre) {
        for (double& component : t) component *= kMillimetresPerMetre;
    }
    const double length = std::hypot(t[0], t[1], t[2]);
    const std::string text = "T = (" + format_fixed(t[0], 4) + ", " + format_fixed(t[1], 4) + ", " +
                             format_fixed(t[2], 4) + ") mm";
    if (!(length > 0)) fail(calibration.translation_origin, "the baseline is zero: " + text + ".");
    const std::string hint = unit_hint(unit, files_unit, length);
    if (length < kSmallestBaseline || length > kLargestBaseline || !hint.empty()) {
        fail(calibration.translation_origin,
             "a baseline of " + format_fixed(length, 6) + " mm is outside " +
                 format_fixed(hint.empty() ? kSmallestBaseline : kSuspectBaseline, 1) +
                 "..1000 mm." + hint);
    }
    if (std::abs(t[1]) >= std::abs(t[0]) && std::abs(t[1]) >= std::abs(t[2])) {
        fail(calibration.translation_origin,
             "the cameras lie above each other (" + text +
                 "); only rigs with the cameras side by side are supported.");
    }
    if (std::hypot(t[1], t[2]) >= std::abs(t[0])) {
        fail(calibration.translation_origin,
             "one camera lies in front of the other (" + text +
                 "); only rigs with the cameras side by side are supported.");
    }
    if (t[0] > 0) {
        fail(calibration.translation_origin,
             "the second camera lies to the left of the first (" + text +
                 "): the views look swapped. Exchange M1, D1 with "
                 "M2, D2 and invert R and T, or, if only the images were named the wrong way "
                 "round, give them as --left "
                 "and --right the other way and recalibrate.");
    }
}

// Distorted normalised coordinates by OpenCV's model of up to 12 coefficients (its tilt is a
// homography and cannot fold the image): k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4]]].
Eigen::Vector2d distort(const std::vector<double>& coefficients, const Eigen::Vector2d& point) {
    const auto k = [&](std::size_t i) { return i < coefficients.size() ? coefficients[i] : 0.0; };
    const double x = point.x(), y = point.y(), r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
    const double radial =
        (1 + k(0) * r2 + k(1) * r4 + k(4) * r6) / (1 + k(5) * r2 + k(6) * r4 + k(7) * r6);
    return {x * radial + 2 * k(2) * x * y + k(3) * (r2 + 2 * x * x) + k(8) * r2 + k(9) * r4,
            y * radial + k(2) * (r2 + 2 * y * y) + 2 * k(3) * x * y + k(10) * r2 + k(11) * r4};
}

// Walks outwards from the centre until the distorted point leaves the image. A model that folds
// back on the way maps two directions to one pixel, and cannot be inverted.
void check_monotone(const CameraCalibration& camera, int width, int height) {
    if (std::all_of(camera.distortion.begin(), camera.distortion.end(),
                    [](double c) { return c == 0; }))
        return;
    constexpr int kDirections = 64;
    constexpr int kSteps = 2000;
    const double reach = 2 * std::hypot(std::max(camera.cx, width - 1 - camera.cx) / camera.fx,
                                        std::max(camera.cy, height - 1 - camera.cy) / camera.fy);
    for (int i = 0; i < kDirections; ++i) {
        const double angle = 2 * std::numbers::pi * i / kDirections;
        const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
        double previous = distort(camera.distortion, {0, 0}).dot(direction);
        for (int step = 1; step <= kSteps; ++step) {
            const double radius = reach * step / kSteps;
            const Eigen::Vector2d distorted = distort(camera.distortion, radius * direction);
            const double u = camera.fx * distorted.x() + camera.cx,
                         v = camera.fy * distorted.y() + camera.cy;
            const double along = distorted.dot(direction);
            if (!(along > previous)) {
                fail(camera.distortion_origin,
                     "the distortion folds back inside the image (" + format_fixed(radius, 3) +
                         " from the axis in normalised units, near pixel " + format_fixed(u, 0) +
                         "," + format_fixed(v, 0) +
                         "); it is not monotone, recalibrate with fewer coefficients.");
            }
            if (u < 0 || v < 0 || u > width - 1 || v > height - 1) break;
            previous = along;
        }
    }
}

void check_centre(const CameraCalibration& camera, int width, int height) {
    const bool is_near = camera.cx >= -0.5 * width && camera.cx <= 1.5 * width &&
                         camera.cy >= -0.5 * height && camera.cy <= 1.5 * height;
    if (!is_near) {
        fail(camera.matrix_origin, "the centre " + format_fixed(camera.cx, 1) + "," +
                                       format_fixed(camera.cy, 1) +
                                       " lies far outside the image of " + std::to_string(width) +
                                       "x" + std::to_string(height) + ".");
    }
}

}  // namespace

void detail::check_and_normalise(StereoCalibration& calibration, LengthUnit unit,
                                 LengthUnit files_unit) {
    check_camera(calibration.left);
    check_camera(calibration.right);
    check_rotation(calibration);
    check_baseline(calibration, unit, files_unit);
}

void fit_to_frames(StereoCalibration& calibration, int width, int height) {
    if (calibration.width > 0 && (calibration.width != width || calibration.height != height)) {
        fail(calibration.size_origin,
             "the calibration is for " + std::to_string(calibration.width) + "x" +
                 std::to_string(calibration.height) + " but the frames are " +
                 std::to_string(width) + "x" + std::to_string(height) +
                 "; nothing is scaled silently, so calibrate for this size or resize the frames.");
    }
    for (const CameraCalibration* camera : {&calibration.left, &calibration.right}) {
        check_centre(*camera, width, height);
        check_monotone(*camera, width, height);
    }
    calibration.width = width;
    calibration.height = height;
}

bool is_rectified(const StereoCalibration& calibration) {
    const auto near = [](double a, double b) { return std::abs(a - b) <= kRectifiedTolerance; };
    const auto is_zero = [](double c) { return c == 0; };
    const CameraCalibration &left = calibration.left, &right = calibration.right;
    const Eigen::Map<const Rotation> rotation(calibration.rotation.data());
    return rotation.isIdentity(kRectifiedTolerance) && near(calibration.translation[1], 0) &&
           near(calibration.translation[2], 0) && near(left.fx, right.fx) &&
           near(left.fy, right.fy) && near(left.cy, right.cy) &&
           std::all_of(left.distortion.begin(), left.distortion.end(), is_zero) &&
           std::all_of(right.distortion.begin(), right.distortion.end(), is_zero);
}

}  // namespace defrec::cli
