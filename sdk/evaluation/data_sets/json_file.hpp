// JSON files of data sets.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sdk/io/calibration.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

// `what` says what the file should hold, for the message. Throws CliError(code).
nlohmann::json read_json_object(const std::filesystem::path& path, const std::string& what,
                                ExitCode code);

// The numbers under `name`, row by row: rows in rows, one row, or OpenCV's {"rows", "cols",
// "data"}. Throws CliError(kCalibration) unless there are as many as one of `counts`; `shape` is
// what was expected, for the message.
std::vector<double> matrix_of(const std::filesystem::path& path, const nlohmann::json& json,
                              const std::string& name, const std::vector<std::size_t>& counts,
                              const std::string& shape);

// [fx 0 cx; 0 fy cy; 0 0 1] under `matrix`; OpenCV's coefficients, or none, under `distortion`.
CameraCalibration camera_of(const std::filesystem::path& path, const nlohmann::json& json,
                            const std::string& matrix, const std::string& distortion);

// Rotation under `rotation`, translation in m under `translation`; x_right = R x_left + T.
void set_pose(const std::filesystem::path& path, const nlohmann::json& json,
              const std::string& rotation, const std::string& translation,
              StereoCalibration& calibration);

}  // namespace defrec::cli
