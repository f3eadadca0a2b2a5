// What the numbers of a stereo calibration must satisfy, whatever file they came from.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "sdk/io/calibration.hpp"
#include "sdk/io/decisions.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Limits = decisions::CalibrationFile;

constexpr double kMillimetresPerMetre = 1000;

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
    if (!(residual <= Limits::kRotationTolerance) || !(determinant > 0)) {
        fail(calibration.rotation_origin,
             "R is not a rotation: |R^T R - 1| reaches " + format_fixed(residual, 6) +
                 " (at most " + format_fixed(Limits::kRotationTolerance, 3) +
                 "), its determinant is " + format_fixed(determinant, 6) + ".");
    }
    if (residual == 0) return;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(Eigen::Matrix3d(rotation),
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    rotation = svd.matrixU() * svd.matrixV().transpose();
}

std::string unit_hint(LengthUnit unit, LengthUnit files_unit, double length) {
    // A unit that was stated is doubted only where no rig has such a baseline.
    if (unit == LengthUnit::kMetre)
        return length > Limits::kMaxBaseline &&
                       length / kMillimetresPerMetre <= Limits::kMaxBaseline
                   ? " It looks like millimetres; if it is, pass --units mm."
                   : "";
    if (unit != LengthUnit::kGuarded) return {};
    if (files_unit == LengthUnit::kMetre) {
        return length > Limits::kMaxBaseline ? " It looks like millimetres where ROS prescribes "
                                               "metres; if it is, pass --units mm."
                                             : "";
    }
    if (length < Limits::kMinBaseline) {
        return length * kMillimetresPerMetre >= Limits::kMinBaseline
                   ? " It looks like metres; if it is, pass --units m."
                   : "";
    }
    if (length < Limits::kSuspectBaseline) {
        return " It looks like centimetres or inches; if it is, convert T to mm (if it really is "
               "mm, pass --units mm; if metres, --units m).";
    }
    return {};
}

void check_baseline(StereoCalibration& calibration, LengthUnit unit, LengthUnit files_unit) {
    detail::turn_into_millimetres(calibration, unit, files_unit);
    const std::array<double, 3>& t = calibration.translation;
    const double length = std::hypot(t[0], t[1], t[2]);
    const std::string text = "T = (" + format_fixed(t[0], 4) + ", " + format_fixed(t[1], 4) + ", " +
                             format_fixed(t[2], 4) + ") mm";
    if (!(length > 0)) fail(calibration.translation_origin, "the baseline is zero: " + text + ".");
    const std::string hint = unit_hint(unit, files_unit, length);
    if (length < Limits::kMinBaseline || length > Limits::kMaxBaseline) {
        fail(calibration.translation_origin,
             "a baseline of " + format_fixed(length, 6) + " mm is outside " +
                 format_fixed(Limits::kMinBaseline, 1) + ".." +
                 format_fixed(Limits::kMaxBaseline, 0) + " mm." + hint);
    }
    if (!hint.empty()) {
        fail(calibration.translation_origin, "a baseline of " + format_fixed(length, 6) +
                                                 " mm is shorter than a stereo endoscope's." +
                                                 hint);
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

void check_centre(const CameraCalibration& camera, int width, int height) {
    constexpr double kMin = -Limits::kMaxOutside, kMax = 1 + Limits::kMaxOutside;
    const bool is_near = camera.cx >= kMin * width && camera.cx <= kMax * width &&
                         camera.cy >= kMin * height && camera.cy <= kMax * height;
    if (!is_near) {
        fail(camera.matrix_origin,
             "the centre " + format_fixed(camera.cx, 1) + "," + format_fixed(camera.cy, 1) +
                 " lies far outside the image of " + size_text(width, height) + ".");
    }
}

}  // namespace

std::string fault_of_distortion(std::size_t length) {
    if (std::find(kDistortionLengths.begin(), kDistortionLengths.end(), length) !=
        kDistortionLengths.end())
        return {};
    return "the distortion has " + std::to_string(length) + " coefficients; OpenCV's models have " +
           kDistortionLengthsText + ".";
}

void detail::turn_into_millimetres(StereoCalibration& calibration, LengthUnit unit,
                                   LengthUnit files_unit) {
    if ((unit == LengthUnit::kGuarded ? files_unit : unit) != LengthUnit::kMetre) return;
    for (double& component : calibration.translation) component *= kMillimetresPerMetre;
}

void detail::check_and_normalise(StereoCalibration& calibration, LengthUnit unit,
                                 LengthUnit files_unit) {
    check_camera(calibration.left);
    check_camera(calibration.right);
    check_rotation(calibration);
    check_baseline(calibration, unit, files_unit);
}

void fit_to_frames(StereoCalibration& calibration, int width, int height) {
    if (calibration.width > 0 && (calibration.width != width || calibration.height != height)) {
        const bool is_beside = width == 2 * calibration.width && height == calibration.height;
        const bool is_above = width == calibration.width && height == 2 * calibration.height;
        fail(
            calibration.size_origin,
            "the calibration is for " + size_text(calibration.width, calibration.height) +
                " but the frames are " + size_text(width, height) +
                (is_beside  ? "; if each image holds both views, give it as --stereo with --layout "
                              "side-by-side."
                 : is_above ? "; if each image holds both views, give it as --stereo with --layout "
                              "top-bottom."
                            : "; nothing is scaled silently, so calibrate for this size or resize "
                              "the frames."));
    }
    check_centre(calibration.left, width, height);
    check_centre(calibration.right, width, height);
    calibration.width = width;
    calibration.height = height;
}

bool is_rectified(const StereoCalibration& calibration) {
    const auto near = [](double a, double b) {
        return std::abs(a - b) <= Limits::kRectifiedTolerance;
    };
    const auto is_zero = [](double c) { return c == 0; };
    const CameraCalibration &left = calibration.left, &right = calibration.right;
    const Eigen::Map<const Rotation> rotation(calibration.rotation.data());
    return rotation.isIdentity(Limits::kRectifiedTolerance) &&
           near(calibration.translation[1], 0) && near(calibration.translation[2], 0) &&
           near(left.fx, right.fx) && near(left.fy, right.fy) && near(left.cy, right.cy) &&
           std::all_of(left.distortion.begin(), left.distortion.end(), is_zero) &&
           std::all_of(right.distortion.begin(), right.distortion.end(), is_zero);
}

}  // namespace defrec::cli
