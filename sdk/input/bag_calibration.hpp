// The calibration of a recording: a file's, or that of a bag's own camera_info.
#pragma once

#include <string>

#include "sdk/input/frame_source.hpp"
#include "sdk/io/calibration.hpp"

namespace defrec::cli {

// file: as written_calibration takes it; empty: the camera_info beside both views' topics of the
// bag, the first message of each. Throws CliError(kCalibration), also where the bag has none that
// is complete, and CliError(kInput) where the bag cannot be read.
WrittenCalibration written_calibration(const SourceOptions& source, const std::string& file);

// For messages and tables.
std::string calibration_name(const SourceOptions& source, const std::string& file);

}  // namespace defrec::cli
