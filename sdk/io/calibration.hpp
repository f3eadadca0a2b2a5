// A stereo rig's calibration as users have it: OpenCV stereo YAML, or a pair of ROS camera_info
// files; read strictly and checked before anything is computed from it.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace defrec::cli {

// The numbers of coefficients that OpenCV's models of distortion have.
inline constexpr std::array<std::size_t, 6> kDistortionLengths = {0, 4, 5, 8, 12, 14};
inline constexpr char kDistortionLengthsText[] = "0, 4, 5, 8, 12 or 14";
// Why a distortion of so many coefficients is refused; "" where it is not.
std::string fault_of_distortion(std::size_t length);

struct CameraCalibration {
    double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels; (0,0) is the centre of the top-left pixel
    std::vector<double> distortion;         // coefficients in OpenCV's order, kDistortionLengths
    std::string matrix_origin;              // "file:line: key" of what is above, for messages
    std::string distortion_origin;
};

// x_right = rotation * x_left + translation.
struct StereoCalibration {
    int width = 0, height = 0;  // pixels; 0 when the file does not say
    CameraCalibration left, right;
    std::array<double, 9> rotation{};     // row-major, orthonormal to rounding
    std::array<double, 3> translation{};  // mm
    std::string size_origin, rotation_origin, translation_origin;
};

// The unit of T (OpenCV) or of P (ROS). kGuarded takes the format's own (mm for OpenCV, metres for
// ROS) and refuses a baseline that only makes sense in the other.
enum class LengthUnit { kGuarded, kMillimetre, kMetre };

// A calibration as it was written: it may be impossible.
struct WrittenCalibration {
    StereoCalibration values;  // T in `unit`
    LengthUnit unit{};         // which the format prescribes
};

// `source`: an OpenCV stereo YAML file; `left.yaml,right.yaml`, two ROS camera_info files; or a
// folder that holds left.yaml and right.yaml. Throws CliError(kCalibration) naming file, key and
// line.
WrittenCalibration written_calibration(const std::string& source);

// With all checks, T in mm; likewise throws.
StereoCalibration load_calibration(const WrittenCalibration& written,
                                   LengthUnit unit = LengthUnit::kGuarded);
StereoCalibration load_calibration(const std::string& source,
                                   LengthUnit unit = LengthUnit::kGuarded);

// T in mm, without the checks.
StereoCalibration read_calibration(WrittenCalibration written,
                                   LengthUnit unit = LengthUnit::kGuarded);

// Throws CliError(kCalibration) unless the calibration can belong to frames of this size; a
// calibration without a size takes it. Called by load_calibration for the size that the file names.
void fit_to_frames(StereoCalibration& calibration, int width, int height);

// True when rows of the two images already correspond: R = 1, T = (-baseline, 0, 0), no distortion,
// equal cameras but for the principal points' x.
bool is_rectified(const StereoCalibration& calibration);

namespace detail {

// T, in `unit` or else in the one that the format prescribes.
void turn_into_millimetres(StereoCalibration& calibration, LengthUnit unit, LengthUnit files_unit);

// The checks that need no image size; replaces the rotation by the nearest exact one and turns T
// into mm. `files_unit` is the unit that the format prescribes. Throws CliError(kCalibration).
void check_and_normalise(StereoCalibration& calibration, LengthUnit unit, LengthUnit files_unit);

}  // namespace detail
}  // namespace defrec::cli
