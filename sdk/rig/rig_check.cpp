// See rig_check.hpp.
#include "sdk/rig/rig_check.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "sdk/base/error.hpp"
#include "sdk/rig/lens.hpp"

namespace defrec {
namespace {

template <class... Pieces>
[[noreturn]] void refuse(const Pieces&... pieces) {
    fail(DEFREC_ERROR_ARGUMENT, pieces...);
}

void check_focal_length(const char* view, const char* name, double value, uint32_t side) {
    if (!(value > 0)) refuse(view, ".", name, " is ", value, ", a focal length > 0 px expected");
    if (value < side / 50.0 || value > side * 1000.0)
        refuse(view, ".", name, " is ", value, " px, which does not fit to images of ", side,
               " px");
}

void check_centre(const char* view, const char* name, double value, uint32_t side) {
    if (value < -1.0 * side || value > 2.0 * side)
        refuse(view, ".", name, " is ", value, " px, far outside images of ", side, " px");
}

void check_distortion(const char* view, const defrec_intrinsics& camera, uint32_t width,
                      uint32_t height) {
    const double tilt = std::max(std::abs(camera.distortion[12]), std::abs(camera.distortion[13]));
    if (camera.distortion_count == 14 && tilt > 1)
        refuse(view, ".distortion tilts the sensor by ", tilt, " rad");
    const Lens lens(camera, image_reach(camera, width, height));
    const char* reason =
        ".distortion is not monotone inside the image: two directions share a pixel; wrong order "
        "of coefficients?";
    if (!lens.monotone()) refuse(view, reason);
    constexpr int kSteps = 16;
    for (int i = 0; i <= kSteps; ++i) {
        const double u = (width - 1.0) * i / kSteps, v = (height - 1.0) * i / kSteps;
        for (const Eigen::Vector2d& pixel :
             {Eigen::Vector2d(u, 0), Eigen::Vector2d(u, height - 1), Eigen::Vector2d(0, v),
              Eigen::Vector2d(width - 1, v)}) {
            Eigen::Vector2d direction;
            if (!lens.unproject(pixel, direction)) refuse(view, reason);
        }
    }
}

void check_camera(const char* view, const defrec_intrinsics& camera, uint32_t width,
                  uint32_t height) {
    static constexpr const char* kNames[] = {"fx", "fy", "cx", "cy"};
    const double values[] = {camera.fx, camera.fy, camera.cx, camera.cy};
    for (int i = 0; i < 4; ++i)
        if (!std::isfinite(values[i])) refuse(view, ".", kNames[i], " is not a finite number");
    check_focal_length(view, "fx", camera.fx, width);
    check_focal_length(view, "fy", camera.fy, height);
    check_centre(view, "cx", camera.cx, width);
    check_centre(view, "cy", camera.cy, height);
    const uint32_t count = camera.distortion_count;
    if (count != 0 && count != 4 && count != 5 && count != 8 && count != 12 && count != 14)
        refuse(view, ".distortion_count is ", count, ", 0, 4, 5, 8, 12 or 14 expected");
    for (uint32_t i = 0; i < count; ++i)
        if (!std::isfinite(camera.distortion[i]))
            refuse(view, ".distortion[", i, "] is not a finite number");
    check_distortion(view, camera, width, height);
}

void check_rotation(const Eigen::Matrix3d& rotation) {
    if (!rotation.allFinite()) refuse("rotation holds a number that is not finite");
    const double residual =
        (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (residual > 1e-3 || rotation.determinant() < 0)
        refuse("rotation is not a rotation: R^T R differs from the identity by ", residual,
               ", the determinant is ", rotation.determinant());
}

void check_baseline(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
    if (!translation.allFinite()) refuse("translation holds a number that is not finite");
    const double length = translation.norm();
    if (length == 0) refuse("translation is 0: two cameras in one place see no depth");
    if (length < 0.1)
        refuse("the baseline is ", length, " mm; if the translation is in metres, it is ",
               length * 1000, " mm");
    const Eigen::AngleAxisd turn(rotation);
    const Eigen::Vector3d half = Eigen::AngleAxisd(-turn.angle() / 2, turn.axis()) * translation;
    const double share = std::abs(half.x()) / length;
    if (share < std::cos(30 * 3.14159265358979 / 180))
        fail(DEFREC_ERROR_UNSUPPORTED, "the baseline is not horizontal: translation is (",
             translation.x(), ", ", translation.y(), ", ", translation.z(), ") mm, ",
             std::round(std::acos(share) * 1800 / 3.14159265358979) / 10,
             " degrees from the x axis, at most 30 are supported");
    if (half.x() > 0)
        refuse("translation[0] is ", translation.x(),
               ": the right camera lies to the left of the left one; are the views swapped?");
}

}  // namespace

double image_reach(const defrec_intrinsics& camera, uint32_t width, uint32_t height) {
    const double x = std::max(std::abs(camera.cx), std::abs(width - 1.0 - camera.cx)) / camera.fx;
    const double y = std::max(std::abs(camera.cy), std::abs(height - 1.0 - camera.cy)) / camera.fy;
    return std::hypot(x, y);
}

void check_rig(const defrec_rig_desc& desc) {
    if (desc.flags != 0) refuse("flags is ", desc.flags, ", 0 expected");
    if (desc.width < DEFREC_MIN_WIDTH || desc.height < DEFREC_MIN_HEIGHT ||
        desc.width > DEFREC_MAX_SIDE || desc.height > DEFREC_MAX_SIDE)
        refuse("images of ", desc.width, " x ", desc.height, " px given, ", int{DEFREC_MIN_WIDTH},
               " x ", int{DEFREC_MIN_HEIGHT}, " to ", int{DEFREC_MAX_SIDE}, " x ",
               int{DEFREC_MAX_SIDE}, " expected");
    check_camera("left", desc.left, desc.width, desc.height);
    check_camera("right", desc.right, desc.width, desc.height);
    const Eigen::Matrix3d rotation =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(desc.rotation);
    check_rotation(rotation);
    check_baseline(rotation, Eigen::Map<const Eigen::Vector3d>(desc.translation));
}

}  // namespace defrec
