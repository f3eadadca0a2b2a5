// See camera_trajectory.hpp.
#include "sdk/session/camera_trajectory.hpp"

#include <Eigen/Geometry>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr double kMillisecondsInSecond = 1000, kMillimetresInMetre = 1000;
constexpr int kSecondDecimals = 6;
constexpr int kMetreDecimals = 7;  // as fine as the millimetres of points.csv
constexpr int kQuaternionDecimals = 9;

}  // namespace

void CameraTrajectory::add(double timestamp_ms, const defrec_result& result) {
    // Camera from template, of which the pose is the inverse.
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> motion(
        result.rigid_motion);
    const Eigen::Matrix3d turned = motion.leftCols<3>().transpose();
    const Eigen::Vector3d place = -(turned * motion.col(3)) / kMillimetresInMetre;
    Eigen::Quaterniond rotation(turned);
    rotation.normalize();
    if (rotation.w() < 0) rotation.coeffs() *= -1;
    append_fixed(lines_, timestamp_ms / kMillisecondsInSecond, kSecondDecimals);
    for (const double coordinate : place) {
        lines_ += ' ';
        append_fixed(lines_, coordinate, kMetreDecimals);
    }
    for (const double component : rotation.coeffs()) {
        lines_ += ' ';
        append_fixed(lines_, component, kQuaternionDecimals);
    }
    lines_ += '\n';
}

void CameraTrajectory::write(const std::filesystem::path& path) const {
    write_atomically(path,
                     "# left rectified camera in the template frame, s and m\n"
                     "# timestamp tx ty tz qx qy qz qw\n" +
                         lines_);
}

}  // namespace defrec::cli
