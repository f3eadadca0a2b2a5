// See rig_check.hpp.
#include "sdk/rig/rig_check.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "sdk/base/util/error.hpp"
#include "sdk/rig/decisions.hpp"
#include "sdk/rig/lens.hpp"

namespace defrec {
namespace {

using decisions::RigLimits;

template <class... Pieces>
[[noreturn]] void refuse(const Pieces&... pieces) {
    fail(DEFREC_ERROR_ARGUMENT, pieces...);
}

void check_focal_length(const char* view, const char* name, double value, uint32_t side) {
    if (!(value > 0)) refuse(view, ".", name, " is ", value, ", a focal length > 0 px expected");
    if (value < side / RigLimits::kMaxSide || value > side * RigLimits::kMaxFocalLength)
        refuse(view, ".", name, " is ", value, " px, which does not fit to images of ", side,
               " px");
}

void check_centre(const char* view, const char* name, double value, uint32_t side) {
    if (value < -RigLimits::kMaxBefore * side || value > RigLimits::kMaxBeyond * side)
        refuse(view, ".", name, " is ", value, " px, far outside images of ", side, " px");
}

double times_apart(double a, double b) { return std::max(a / b, b / a); }

// Focal lengths along both sides differ where pixels are not square, and hardly else.
void check_aspect(const char* view, const defrec_intrinsics& camera) {
    if (times_apart(camera.fx, camera.fy) > RigLimits::kTooFarApart)
        refuse(view, ".fx is ", camera.fx, " px and ", view, ".fy ", camera.fy, " px, at most ",
               RigLimits::kTooFarApart, " times apart expected");
}

// Cameras with a centre that is off in both directions alike are hardly built.
void doubt_camera(const Services& services, const char* view, const defrec_intrinsics& camera,
                  uint32_t width, uint32_t height) {
    const double off_x = camera.cx / width - 0.5, off_y = camera.cy / height - 0.5;
    if (off_x * off_y > 0 && std::min(std::abs(off_x), std::abs(off_y)) > RigLimits::kFarOff)
        services.log(DEFREC_LOG_WARNING, "sdk",
                     concat(view, ": the principal point (", camera.cx, ", ", camera.cy,
                            ") lies far from the middle of images of ", width, " x ", height,
                            " px; is the calibration one of images of another size?")
                         .c_str());
    if (times_apart(camera.fx, camera.fy) > RigLimits::kFarApart)
        services.log(DEFREC_LOG_WARNING, "sdk",
                     concat(view, ": the focal lengths ", camera.fx, " and ", camera.fy,
                            " px differ; are the images stretched, or the calibration one of "
                            "images of another shape?")
                         .c_str());
}

void doubt_pair(const Services& services, const defrec_rig_desc& desc) {
    if (times_apart(desc.left.fx, desc.right.fx) > RigLimits::kFarApart ||
        times_apart(desc.left.fy, desc.right.fy) > RigLimits::kFarApart)
        services.log(DEFREC_LOG_WARNING, "sdk",
                     concat("the focal lengths of left (", desc.left.fx, ", ", desc.left.fy,
                            " px) and right view (", desc.right.fx, ", ", desc.right.fy,
                            " px) differ; are both calibrated at the same zoom?")
                         .c_str());
}

// Part of the image to which the lens has no direction; 0 for the lens of a sound calibration.
double folded_share(const Lens& lens, uint32_t width, uint32_t height) {
    size_t pixels = 0, folded = 0;
    for_each_pixel(width, height, [&](const Eigen::Vector2d& pixel) {
        Eigen::Vector2d direction;
        ++pixels;
        folded += !lens.unproject(pixel, direction);
    });
    return static_cast<double>(folded) / static_cast<double>(pixels);
}

void check_distortion(const Services& services, const char* view, const defrec_intrinsics& camera,
                      uint32_t width, uint32_t height) {
    const double tilt = std::max(std::abs(camera.distortion[12]), std::abs(camera.distortion[13]));
    if (camera.distortion_count == 14 && tilt > RigLimits::kMaxTilt)
        refuse(view, ".distortion tilts the sensor by ", tilt, " rad");
    const Lens lens(camera, width, height);
    const double share = folded_share(lens, width, height);
    if (share == 0) return;
    const std::string fold =
        concat(view, ".distortion is not monotone: ", std::round(1000 * share) / 10,
               " % of the image lie beyond ", std::round(1000 * lens.limit()) / 1000,
               " focal lengths off the axis, where two directions share a pixel");
    if (share > RigLimits::kMaxFoldedShare) refuse(fold, "; wrong order of coefficients?");
    services.log(DEFREC_LOG_WARNING, "sdk", (fold + "; they are masked").c_str());
}

void check_camera(const Services& services, const char* view, const defrec_intrinsics& camera,
                  uint32_t width, uint32_t height) {
    static constexpr const char* kNames[] = {"fx", "fy", "cx", "cy"};
    const double values[] = {camera.fx, camera.fy, camera.cx, camera.cy};
    for (int i = 0; i < 4; ++i)
        if (!std::isfinite(values[i])) refuse(view, ".", kNames[i], " is not a finite number");
    check_focal_length(view, "fx", camera.fx, width);
    check_focal_length(view, "fy", camera.fy, height);
    check_centre(view, "cx", camera.cx, width);
    check_centre(view, "cy", camera.cy, height);
    check_aspect(view, camera);
    doubt_camera(services, view, camera, width, height);
    const uint32_t count = camera.distortion_count;
    if (count != 0 && count != 4 && count != 5 && count != 8 && count != 12 && count != 14)
        refuse(view, ".distortion_count is ", count, ", 0, 4, 5, 8, 12 or 14 expected");
    for (uint32_t i = 0; i < count; ++i)
        if (!std::isfinite(camera.distortion[i]))
            refuse(view, ".distortion[", i, "] is not a finite number");
    check_distortion(services, view, camera, width, height);
}

void check_rotation(const Eigen::Matrix3d& rotation) {
    if (!rotation.allFinite()) refuse("rotation holds a number that is not finite");
    const double residual =
        (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (residual > RigLimits::kRotationTolerance || rotation.determinant() < 0)
        refuse("rotation is not a rotation: R^T R differs from the identity by ", residual,
               ", the determinant is ", rotation.determinant());
}

constexpr double kDegree = std::numbers::pi / 180;

void check_baseline(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
    if (!translation.allFinite()) refuse("translation holds a number that is not finite");
    constexpr double kMinBaseline = RigLimits::kMinBaseline, kMaxBaseline = RigLimits::kMaxBaseline;
    const double length = translation.norm();
    if (length == 0) refuse("translation is 0: two cameras in one place see no depth");
    const double from_metres = 1000 * length;
    if (length < kMinBaseline && from_metres >= kMinBaseline)
        refuse("the baseline is ", length, " mm; if the translation is in metres, it is ",
               from_metres, " mm");
    if (length < kMinBaseline || length > kMaxBaseline)
        refuse("the baseline is ", length, " mm, ", kMinBaseline, " to ", kMaxBaseline,
               " expected");
    const Eigen::AngleAxisd turn(rotation);
    if (turn.angle() > RigLimits::kMaxTurn * kDegree)
        fail(DEFREC_ERROR_UNSUPPORTED, "the cameras look ",
             std::round(turn.angle() / kDegree * 10) / 10, " degrees apart, at most ",
             RigLimits::kMaxTurn, " are supported");
    const Eigen::Vector3d half = Eigen::AngleAxisd(-turn.angle() / 2, turn.axis()) * translation;
    const double share = std::abs(half.x()) / length;
    if (share < std::cos(RigLimits::kMaxSlope * kDegree))
        fail(DEFREC_ERROR_UNSUPPORTED, "the baseline is not horizontal: translation is (",
             translation.x(), ", ", translation.y(), ", ", translation.z(), ") mm, ",
             std::round(std::acos(share) / kDegree * 10) / 10, " degrees from the x axis, at most ",
             RigLimits::kMaxSlope, " are supported");
    if (half.x() > 0)
        refuse("translation[0] is ", translation.x(),
               ": the right camera lies to the left of the left one; are the views swapped?");
}

}  // namespace

void check_rig(const Services& services, const defrec_rig_desc& desc) {
    if (desc.flags != 0) refuse("flags is ", desc.flags, ", 0 expected");
    if (desc.width < DEFREC_MIN_WIDTH || desc.height < DEFREC_MIN_HEIGHT ||
        desc.width > DEFREC_MAX_SIDE || desc.height > DEFREC_MAX_SIDE)
        refuse("images of ", desc.width, " x ", desc.height, " px given, ", int{DEFREC_MIN_WIDTH},
               " x ", int{DEFREC_MIN_HEIGHT}, " to ", int{DEFREC_MAX_SIDE}, " x ",
               int{DEFREC_MAX_SIDE}, " expected");
    check_camera(services, "left", desc.left, desc.width, desc.height);
    check_camera(services, "right", desc.right, desc.width, desc.height);
    doubt_pair(services, desc);
    const Eigen::Matrix3d rotation =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(desc.rotation);
    check_rotation(rotation);
    check_baseline(rotation, Eigen::Map<const Eigen::Vector3d>(desc.translation));
}

}  // namespace defrec
