// See ros_calibration.hpp.
#include "sdk/io/ros_calibration.hpp"

#include <Eigen/Core>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

[[noreturn]] void fail(const std::string& origin, const std::string& message) {
    throw CliError(ExitCode::kCalibration, origin + ": " + message);
}

}  // namespace

void set_camera_matrix(const std::vector<double>& k, const std::string& origin,
                       CameraCalibration& camera) {
    if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
        fail(origin, "[fx 0 cx; 0 fy cy; 0 0 1] was expected (skew is not supported).");
    camera.fx = k[0];
    camera.cx = k[2];
    camera.fy = k[4];
    camera.cy = k[5];
    camera.matrix_origin = origin;
}

void check_distortion_model(const std::string& name, const std::string& origin) {
    if (name == "plumb_bob" || name == "rational_polynomial" || name.empty()) return;
    fail(origin, "'" + printable(name.substr(0, 40)) +
                     "' is not supported; plumb_bob and rational_polynomial are.");
}

// camera_info has no R and T: each view's rectification takes it to a common camera, and P of the
// right view is [f' 0 cx' -f' B; ...] (sensor_msgs/CameraInfo). Hence R = R2^T R1 and T = R2^T (-B,
// 0, 0).
StereoCalibration rig_of(const RosCamera& left, const RosCamera& right) {
    const std::array<double, 12>& p = right.projection;
    if (!(p[0] > 0) || !(p[5] > 0))
        fail(right.projection_origin, "the focal lengths in P must be greater than 0.");
    if (left.projection[3] != 0 && p[3] == 0)
        fail(
            left.projection_origin,
            "P of the left camera carries the baseline: the cameras are exchanged; files are given "
            "as left,right.");
    StereoCalibration calibration;
    calibration.left = left.camera;
    calibration.right = right.camera;
    const Eigen::Vector3d baseline(p[3] / p[0], p[7] / p[5], p[11]);
    const Eigen::Map<const Rotation> of_left(left.rectification.data()),
        of_right(right.rectification.data());
    Eigen::Map<Rotation>(calibration.rotation.data()) = of_right.transpose() * of_left;
    Eigen::Map<Eigen::Vector3d>(calibration.translation.data()) = of_right.transpose() * baseline;
    calibration.rotation_origin =
        right.rectification_origin.empty() ? right.projection_origin : right.rectification_origin;
    calibration.translation_origin = right.projection_origin;

    calibration.width = left.width;
    calibration.height = left.height;
    calibration.size_origin = left.size_origin;
    if (right.width != left.width || right.height != left.height)
        fail(right.width > 0 ? right.size_origin : left.size_origin,
             "the cameras name different image sizes, " + size_text(left.width, left.height) +
                 " on the left and " + size_text(right.width, right.height) + " on the right.");
    return calibration;
}

}  // namespace defrec::cli
